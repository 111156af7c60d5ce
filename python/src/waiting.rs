//! Jobs that Python waits for without its lock, and that an interrupt ends.

use meshmark_marking::ThreadPool;
use pyo3::{
    exceptions::{PyKeyboardInterrupt, PyOSError},
    prelude::*,
};
use std::{
    any::Any,
    cell::RefCell,
    panic::{self, AssertUnwindSafe, resume_unwind},
    sync::{
        Mutex,
        atomic::{AtomicBool, AtomicUsize, Ordering},
        mpsc::{RecvTimeoutError, Sender, channel},
    },
    thread::{self, available_parallelism},
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
    stage: Mutex<Option<&'static str>>,
    done: AtomicUsize,
    all: AtomicUsize,
}

impl Job {
    /// Sets how many steps there are.
    pub fn start(&self, all: usize) {
        self.all.store(all, Ordering::Relaxed);
    }

    /// Begins a stage of so many steps (0: unknown), whose name progress is called with; ends the job if
    /// Python has been interrupted.
    pub fn begin(&self, stage: &'static str, all: usize) {
        *self.stage.lock().expect("nobody panics with it") = Some(stage);
        self.done.store(0, Ordering::Relaxed);
        self.start(all);
        self.steps(0);
    }

    /// Counts a step; ends the job if Python has been interrupted.
    pub fn step(&self) {
        self.steps(1);
    }

    /// Counts steps; ends the job if Python has been interrupted.
    pub fn steps(&self, steps: usize) {
        self.done.fetch_add(steps, Ordering::Relaxed);
        if self.is_cancelled.load(Ordering::Relaxed) {
            resume_unwind(Box::new(Cancelled(None)));
        }
    }
}

/// What a job sends to the thread that waits for it.
enum Message {
    /// Work for that thread.
    Call(Box<dyn FnOnce(Python) + Send>),
    /// The job has ended.
    Done,
}

thread_local! {
    /// Leads to the thread that waits for the job of this one.
    static WAITING: RefCell<Option<Sender<Message>>> = const { RefCell::new(None) };
}

/// Calls `f` on the thread of Python that waits for the job of this one, or at once where there is none.
/// Pyproj keeps its state for each thread of Python, and one that Rust starts is new to Python at every
/// call.
pub fn call_waiting<T: Send + 'static>(f: impl FnOnce(Python) -> T + Send + 'static) -> T {
    let Some(waiting) = WAITING.with_borrow(Option::clone) else { return Python::attach(f) };
    let (answer, answered) = channel();
    let call = Box::new(move |py: Python| drop(answer.send(f(py))));
    waiting.send(Message::Call(call)).expect("a thread waits for the job");
    answered.recv().expect("the waiting thread answers")
}

/// Runs a job on threads of its own (all processors by default), while other threads of Python run.
/// `progress` is called with the name of the stage, where a job has several, the steps done and all
/// steps, when they have changed.
pub fn run<T: Send>(
    py: Python,
    progress: Option<&Bound<PyAny>>,
    threads: Option<usize>,
    job: impl FnOnce(&Job) -> PyResult<T> + Send,
) -> PyResult<T> {
    let threads = threads.unwrap_or_else(|| available_parallelism().map_or(1, usize::from));
    let pool = ThreadPool::new(threads, || (), || ());
    let pool = pool.map_err(|error| PyOSError::new_err(format!("the system gives no threads: {error}")))?;
    let state = Job { is_cancelled: false.into(), stage: None.into(), done: 0.into(), all: 0.into() };
    let (sender, receiver) = channel();
    let receiver = Mutex::new(receiver); // that a closure without Python's lock may borrow it
    let result = Mutex::new(None);
    let job = || {
        pool.install(|| {
            WAITING.set(Some(sender.clone()));
            job(&state)
        })
    };
    thread::scope(|scope| {
        scope.spawn(|| {
            let ended = panic::catch_unwind(AssertUnwindSafe(job));
            *result.lock().expect("nobody panics with it") = Some(ended);
            drop(sender.send(Message::Done));
        });
        let (mut interrupt, mut shown) = (None, (None, 0));
        loop {
            let received =
                py.detach(|| receiver.lock().expect("nobody panics with it").recv_timeout(PATIENCE));
            if interrupt.is_none() {
                interrupt = py.check_signals().and_then(|()| show(&state, progress, &mut shown)).err();
                state.is_cancelled.store(interrupt.is_some(), Ordering::Relaxed);
            }
            match received {
                Ok(Message::Call(call)) => call(py),
                Ok(Message::Done) => {
                    let ended = result.lock().expect("nobody panics with it").take().expect("it has ended");
                    let result = ended.unwrap_or_else(|thrown| Err(exception(thrown)));
                    return interrupt.map_or(result, Err);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => unreachable!("the job sends its result"),
            }
        }
    })
}

fn show(
    state: &Job,
    progress: Option<&Bound<PyAny>>,
    shown: &mut (Option<&'static str>, usize),
) -> PyResult<()> {
    let stage = *state.stage.lock().expect("nobody panics with it");
    let (done, all) = (state.done.load(Ordering::Relaxed), state.all.load(Ordering::Relaxed));
    match progress {
        Some(progress) if (stage, done) != *shown => {
            *shown = (stage, done);
            let called = match stage {
                Some(stage) => progress.call1((stage, done, all)),
                None => progress.call1((done, all)),
            };
            called.map(drop)
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
