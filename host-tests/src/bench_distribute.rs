//! What a further recipient costs: `meshmark distribute` to one and to nine, beside plain `ogr2ogr`.

use std::{fs, io, path::Path, process::Command, time::Instant};

/// Recipients of the long list.
const MANY: usize = 9;

/// Seconds of whole processes.
#[derive(Debug, Clone, Copy)]
pub struct Distributed {
    /// Plain `ogr2ogr -f GPKG`.
    pub plain: f64,
    /// To one recipient.
    pub one: f64,
    /// To nine.
    pub many: f64,
}

impl Distributed {
    /// Runs all three in `folder`, which has a key `key.json`.
    ///
    /// # Errors
    /// A process that cannot be run or fails.
    pub fn measure(meshmark: &Path, map: &Path, folder: &Path) -> io::Result<Self> {
        let distribute = |recipients: usize| {
            let (list, output) = (folder.join("list.csv"), folder.join("copies"));
            let names: String = (1..=recipients).map(|number| format!("recipient {number}\n")).collect();
            fs::write(&list, names)?;
            let mut command = Command::new(meshmark);
            command.arg("distribute").arg("--key").arg(folder.join("key.json")).arg("--recipients").arg(list);
            let seconds = timed(command.arg("--output-dir").arg(&output).arg(map))?;
            fs::remove_dir_all(output)?;
            Ok::<f64, io::Error>(seconds)
        };
        let plain = folder.join("plain_beside.gpkg");
        let measured = Distributed {
            plain: timed(Command::new("ogr2ogr").args(["-f", "GPKG"]).arg(&plain).arg(map))?,
            one: distribute(1)?,
            many: distribute(MANY)?,
        };
        fs::remove_file(plain)?;
        Ok(measured)
    }

    /// Seconds for each further recipient.
    pub fn further(&self) -> f64 {
        (self.many - self.one) / (MANY - 1) as f64
    }

    /// A cell of the table: seconds to one and to nine, for each further one, and that over plain `ogr2ogr`.
    pub fn cell(&self) -> String {
        let further = self.further();
        format!("{:.2} / {:.2}; {further:.2}; {:.2}", self.one, self.many, further / self.plain)
    }
}

fn timed(command: &mut Command) -> io::Result<f64> {
    let since = Instant::now();
    let output = command.output()?;
    match output.status.success() {
        true => Ok(since.elapsed().as_secs_f64()),
        false => Err(io::Error::other(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr)))),
    }
}
