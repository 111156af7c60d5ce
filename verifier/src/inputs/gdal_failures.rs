//! GDAL's failure messages: kept, and included in the messages of this crate.

use gdal::errors::GdalError;
use std::{
    cell::RefCell,
    error, fmt,
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

/// GDAL's number of failed allocations, CPLE_OutOfMemory.
const OUT_OF_MEMORY: i32 = 2;

/// What messages under other numbers say of them: that of SQLite, and that of shapelib.
const WORDS_ABOUT_MEMORY: &[&str] = &["out of memory", "Not enough memory"];

static RAN_OUT_OF_MEMORY: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// Keeps GDAL's last error message on this thread.
    static LAST_FAILURE: RefCell<Option<String>> = const { RefCell::new(None) };
    /// The path of the copy that GDAL reads on this thread, and the one that its messages name instead.
    static COPY: RefCell<Option<[String; 2]>> = const { RefCell::new(None) };
}

/// Keeps GDAL from printing, and keeps its messages for this crate. Call it once, before any other
/// use of GDAL.
pub fn quieten_gdal() {
    gdal::config::set_error_handler(|kind, number, message| {
        if number == OUT_OF_MEMORY || WORDS_ABOUT_MEMORY.iter().any(|words| message.contains(words)) {
            RAN_OUT_OF_MEMORY.store(true, Ordering::Relaxed);
        }
        if matches!(kind, gdal::errors::CplErrType::Failure | gdal::errors::CplErrType::Fatal) {
            let named = COPY.with_borrow(|copy| {
                let [copy, original] = copy.as_ref()?;
                Some(message.replace(copy, original))
            });
            LAST_FAILURE.set(Some(named.unwrap_or_else(|| message.to_string())));
        }
    });
}

/// Returns whether GDAL or SQLite had too little memory at any time. They go on without what they
/// could not hold, so that no result is valid.
pub fn ran_out_of_memory() -> bool {
    RAN_OUT_OF_MEMORY.load(Ordering::Relaxed)
}

/// Lets GDAL's messages name the original in place of the copy while the result lives.
pub(super) fn named_as(original: &Path, copy: &Path) -> Names {
    COPY.set(Some([copy, original].map(|path| path.to_string_lossy().into_owned())));
    Names
}

/// The end of the names of [`named_as`].
pub(super) struct Names;

impl Drop for Names {
    fn drop(&mut self) {
        COPY.set(None);
    }
}

/// A failure of a function of GDAL. Its message on this thread is more exact than the error of the
/// function.
#[derive(Debug)]
pub struct GdalFailure {
    message: Option<String>,
    source: Box<GdalError>,
}

impl GdalFailure {
    /// Adds the last message since [`forget_failure`].
    pub(crate) fn new(source: GdalError) -> Self {
        GdalFailure { message: last_failure(), source: Box::new(source) }
    }
}

impl fmt::Display for GdalFailure {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match &self.message {
            Some(message) => f.write_str(message),
            None => self.source.fmt(f),
        }
    }
}

impl error::Error for GdalFailure {
    fn source(&self) -> Option<&(dyn error::Error + 'static)> {
        Some(&*self.source)
    }
}

/// Returns GDAL's last error message on this thread since the last call or [`forget_failure`].
pub(crate) fn last_failure() -> Option<String> {
    LAST_FAILURE.take()
}

/// Discards the failures of earlier operations.
pub(crate) fn forget_failure() {
    LAST_FAILURE.set(None);
}
