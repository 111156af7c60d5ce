//! Jobs that Python waits for without its lock, and that an interrupt ends.

use pyo3::{exceptions::PyKeyboardInterrupt, prelude::*};
use std::{
    any::Any,
    panic::{self, AssertUnwindSafe, resume_unwind},
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc::{RecvTimeoutError, channel},
    },
    thread,
    time::Duration,
};

/// The time between two looks at interrupts.
const PATIENCE: Duration = Duration::from_millis(50);

/// What unwinds a job that is cancelled, up to [`run`]; it is no panic, and nothing is printed.
pub struct Cancelled(Option<PyErr>);

impl Cancelled {
    /// Ends the job with an exception.
    pub fn with(error: PyErr) -> ! {
        resume_unwind(Box::new(Cancelled(Some(error))))
    }
}

/// The progress of a job, which its steps report.
pub struct Job {
    is_cancelled: AtomicBool,
    done: AtomicUsize,
    all: AtomicUsize,
}

impl Job {
    /// Sets how many steps there are.
    pub fn start(&self, all: usize) {
        self.all.store(all, Ordering::Relaxed);
    }

    /// Counts a step; ends the job if Python has been interrupted.
    pub fn step(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
        if self.is_cancelled.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Cancelled(None)));
        }
    }
}

/// Runs a job on a thread of its own, while other threads of Python run. `progress` is called with the
/// steps done and all steps, when they have changed.
pub fn run<T: Send>(
    py: Python,
    progress: Option<&Bound<PyAny>>,
    job: impl FnOnce(&Job) -> PyResult<T> + Send,
) -> PyResult<T> {
    let state = Job { is_cancelled: false.into(), done: 0.into(), all: 0.into() };
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver); // that a closure without Python's lock may borrow it
    thread::scope(|scope| {
        scope.spawn(|| {
            drop(sender.send(panic::catch_unwind(AssertUnwindSafe(|| job(&state)))));
        });
        let (mut interrupt, mut shown) = (None, 0);
        loop {
            let received =
                py.detach(|| receiver.lock().expect("nobody panics with it").recv_timeout(PATIENCE));
            if interrupt.is_none() {
                interrupt = py.check_signals().and_then(|()| show(&state, progress, &mut shown)).err();
                state.is_cancelled.store(interrupt.is_some(), Ordering::Relaxed);
            }
            match received {
                Ok(result) => {
                    let result = result.unwrap_or_else(|thrown| Err(exception(thrown)));
                    return interrupt.map_or(result, Err);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => unreachable!("the job sends its result"),
            }
        }
    })
}

fn show(state: &Job, progress: Option<&Bound<PyAny>>, shown: &mut usize) -> PyResult<()> {
    let (done, all) = (state.done.load(Ordering::Relaxed), state.all.load(Ordering::Relaxed));
    match progress {
        Some(progress) if done != *shown => {
            *shown = done;
            progress.call1((done, all)).map(drop)
        }
        _ => Ok(()),
    }
}

/// Returns the exception of a job that was cancelled. A panic goes on, and pyo3 makes it an exception.
fn exception(thrown: Box<dyn Any + Send>) -> PyErr {
    match thrown.downcast::<Cancelled>() {
        Ok(cancelled) => cancelled.0.unwrap_or_else(|| PyKeyboardInterrupt::new_err(())),
        Err(panicked) => resume_unwind(panicked),
    }
}
