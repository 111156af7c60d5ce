//! Threads that end with their job, so that a process may fork between two jobs.

use std::{
    io,
    thread::{Builder, JoinHandle},
};

/// A pool whose threads have ended when it is dropped. Those of rayon's own pool end later,
/// possibly while the process ends, when GDAL has released its storage for them and reports an
/// error.
pub struct ThreadPool {
    /// Declared first, so that the pool is dropped, and its threads begin to end, before they are
    /// awaited.
    pool: rayon::ThreadPool,
    _threads: Joined,
}

impl ThreadPool {
    /// Starts `threads` threads. Each runs `start` first and `end` last.
    ///
    /// # Errors
    /// Fails when the system provides no more threads.
    pub fn new(threads: usize, start: fn(), end: fn()) -> io::Result<Self> {
        let mut started = Joined(Vec::with_capacity(threads));
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let builder = builder.start_handler(move |_| start()).exit_handler(move |_| end());
        let builder = builder.spawn_handler(|thread| {
            started.0.push(Builder::new().spawn(|| thread.run())?);
            Ok(())
        });
        let pool = builder.build().map_err(io::Error::other)?;
        Ok(ThreadPool { pool, _threads: started })
    }

    /// Runs `f` on these threads.
    pub fn install<R: Send>(&self, f: impl FnOnce() -> R + Send) -> R {
        self.pool.install(f)
    }
}

/// Waits for its threads, and for their thread-local storage, when it is dropped.
struct Joined(Vec<JoinHandle<()>>);

impl Drop for Joined {
    fn drop(&mut self) {
        // A thread that panicked has ended as well.
        self.0.drain(..).for_each(|thread| drop(thread.join()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        sync::atomic::{AtomicUsize, Ordering},
        thread,
        time::Duration,
    };

    /// Thread-local storage, like that of GDAL: it is released slowly when the thread ends.
    struct Storage;

    static ENDED: AtomicUsize = AtomicUsize::new(0);

    impl Drop for Storage {
        fn drop(&mut self) {
            thread::sleep(Duration::from_millis(50));
            ENDED.fetch_add(1, Ordering::SeqCst);
        }
    }

    thread_local!(static STORAGE: Storage = const { Storage });

    #[test]
    fn no_thread_outlives_its_pool() {
        let touch = || STORAGE.with(|_| ());
        let pool = ThreadPool::new(3, touch, || thread::sleep(Duration::from_millis(50))).unwrap();
        assert_eq!(pool.install(rayon::current_num_threads), 3);
        drop(pool);
        assert_eq!(ENDED.load(Ordering::SeqCst), 3);
    }
}
