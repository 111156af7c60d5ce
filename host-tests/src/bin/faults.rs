//! Kills writers of marked maps and simulates full disks more often than the tests do:
//! `make faults`.

use clap::Parser;
use meshmark_host_tests::faults::{Distribution, Fault, Outcome, Scene};
use rand_chacha::{
    ChaCha20Rng,
    rand_core::{Rng, SeedableRng},
};

/// Fails when anything but the complete output or the previous state is ever left.
#[derive(Parser)]
struct Arguments {
    /// Number of kills at random moments
    #[arg(long, default_value_t = 100)]
    kills: usize,
    /// Interval, in calls that change files, between kills and between full disks
    #[arg(long, default_value_t = 10)]
    step: usize,
    /// Seed of the random moments; by default a new one
    #[arg(long)]
    seed: Option<u64>,
}

fn main() {
    let arguments = Arguments::parse();
    let seed = arguments.seed.unwrap_or_else(|| {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        now.expect("after 1970").as_nanos() as u64
    });
    println!("seed {seed}");
    let mut random = ChaCha20Rng::seed_from_u64(seed);
    for (target, replaces) in [("out.gpkg", false), ("out.gpkg", true), ("out.shp", true), ("out.fgb", false)]
    {
        let scene = Scene::new(target, replaces);
        let calls = scene.count_calls();
        let what = format!("{target}{}", if replaces { ", replacing another" } else { "" });
        let at = || (1..=calls).filter(|at| at % arguments.step == 0 || at + 30 > calls);
        run(&scene, &format!("{what}: killed at a call"), at().map(Fault::Kill));
        run(&scene, &format!("{what}: full disk from a call on"), at().map(Fault::FullDisk));
        let moment = |_| Fault::KillAfter(0.01 + 0.8 * f64::from(random.next_u32()) / f64::from(u32::MAX));
        run(&scene, &format!("{what}: killed at a random moment"), (0..arguments.kills / 4).map(moment));
    }
    for format in ["GPKG", "ESRI Shapefile"] {
        let distribution = Distribution::new(format);
        let calls = distribution.count_calls();
        let mut copies = [0; 4];
        for at in (1..=calls).filter(|at| at % arguments.step == 0) {
            for fault in [Fault::Kill(at), Fault::FullDisk(at)] {
                distribution.reset();
                copies[distribution.survives(fault)] += 1;
            }
        }
        println!("distribute {format}: 0, 1, 2, 3 copies after {copies:?} faults, all after the next run");
    }
}

fn run(scene: &Scene, what: &str, faults: impl Iterator<Item = Fault>) {
    let mut counts = [0; 2];
    for fault in faults {
        scene.reset();
        counts[usize::from(scene.survives(fault) == Outcome::Complete)] += 1;
    }
    println!("{what}: {} as before, {} complete, nothing else", counts[0], counts[1]);
}
