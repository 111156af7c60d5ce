//! The stages of marking, in this process: the best of two runs, seconds.

use gdal::Dataset;
use meshmark_core::{
    embedding::embed,
    key::SecretKey,
    message::Message,
    options::Parameters,
    patches::{Patch, Patches},
    spectrum::Basis,
};
use meshmark_dataset::{Selection, Survey, survey};
use meshmark_host_tests::Result;
use rayon::prelude::*;
use serde::Serialize;
use std::{hint::black_box, path::Path, time::Instant};

/// Number of patches that are solved, spread over the map.
const SOLVED: usize = 96;

/// The times of the stages, seconds.
#[derive(Debug, Clone, Serialize)]
pub struct Stages {
    pub vertices: usize,
    pub patches: usize,
    pub read_s: f64,
    /// Time of mesh, constraints and patches.
    pub cut_s: f64,
    /// Time of one patch on one thread, the mean of several.
    pub solve_s: f64,
    /// The factor by which two threads solve them faster than one.
    pub solve_speed_up: f64,
    /// Time of mesh, patches, solves, topology and reading back on all threads.
    pub embed_s: f64,
}

impl Stages {
    /// Measures the stages of a map.
    ///
    /// # Errors
    /// Fails when the map cannot be read or marked.
    pub fn measure(path: &Path) -> Result<Self> {
        let parameters = Parameters::default();
        let (key, message) = (SecretKey::from_bytes([7; 32]), Message::from_bytes(&[0xa5; 16]));
        let (read_s, map) = best_of_two(|| read(path))?;
        let (cut_s, patches) = best_of_two(|| Ok(Patches::new(&map.map(&parameters)?, &parameters)?))?;
        let columns = patches.carriers(message.len(), &parameters)? + 1;
        let step = patches.as_slice().len().div_ceil(SOLVED);
        let some: Vec<&Patch> = patches.as_slice().iter().step_by(step).collect();
        let [one_s, two_s] = [1, 2].map(|threads| solve_all(&some, columns, threads));
        let (one_s, two_s) = (one_s?, two_s?);
        let (embed_s, _) = best_of_two(|| Ok(embed(&map.map(&parameters)?, &key, &message, &parameters)?))?;
        Ok(Stages {
            vertices: map.data.vertices.len(),
            patches: patches.as_slice().len(),
            read_s,
            cut_s,
            solve_s: one_s / some.len() as f64,
            solve_speed_up: one_s / two_s,
            embed_s,
        })
    }

    /// Returns seconds of processor time for solving every patch.
    pub fn solves_s(&self) -> f64 {
        self.solve_s * self.patches as f64
    }
}

fn solve_all(patches: &[&Patch], columns: usize, threads: usize) -> Result<f64> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let solve = |patch: &&Patch| Basis::low_frequencies(patch, columns).map(|basis| drop(black_box(basis)));
    let (seconds, ()) = best_of_two(|| Ok(pool.install(|| patches.par_iter().try_for_each(solve))?))?;
    Ok(seconds)
}

/// Returns the fewest seconds that `f` takes, and its result.
fn best_of_two<T>(mut f: impl FnMut() -> Result<T>) -> Result<(f64, T)> {
    let mut timed = || {
        let since = Instant::now();
        f().map(|value| (since.elapsed().as_secs_f64(), value))
    };
    let (first, _) = timed()?;
    let (second, value) = timed()?;
    Ok((first.min(second), value))
}

/// Reads a map as the driver does.
fn read(path: &Path) -> Result<Survey> {
    Ok(survey(&Dataset::open(path)?, &Selection::default())?)
}
