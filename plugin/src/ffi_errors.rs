//! GDAL's errors: this library emits one per failure, collects those of the functions that it
//! calls, and turns panics into errors.

use crate::error::{Error, Result};
use gdal_sys::{CPLErr, CPLErrorNum, OGRErr};
use std::{
    any::Any,
    cell::RefCell,
    ffi::{CStr, CString, c_char},
    fmt::Display,
    marker::PhantomData,
    panic::{self, AssertUnwindSafe},
    sync::{Mutex, PoisonError},
};

const CPLE_APP_DEFINED: CPLErrorNum = 1;

/// Emits one GDAL error or warning.
pub fn report(class: CPLErr::Type, message: impl Display) {
    emit(class, CPLE_APP_DEFINED, &message.to_string());
}

fn emit(class: CPLErr::Type, number: CPLErrorNum, message: &str) {
    let message = CString::new(message.replace('\0', " ")).expect("there is no NUL left");
    // SAFETY: the format takes exactly one C string, and both outlive the call.
    unsafe { gdal_sys::CPLError(class, number, c"%s".as_ptr(), message.as_ptr()) };
}

/// Runs `f`; a panic becomes one GDAL failure and `on_panic`. Every function that C++ calls runs
/// under this guard, as unwinding into C++ would be undefined.
pub fn guarded<T>(on_panic: T, f: impl FnOnce() -> T) -> T {
    match panic::catch_unwind(AssertUnwindSafe(f)) {
        Ok(value) => value,
        Err(payload) => {
            let reason = describe(payload.as_ref());
            let place = take_panic_place();
            report(CPLErr::CE_Failure, format!("MESHMARK failed inside, please report it: {reason}{place}"));
            // A payload's own destructor may panic too; panics are rare enough to leak it.
            std::mem::forget(payload);
            on_panic
        }
    }
}

fn describe(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no reason known")
}

static PANIC_PLACE: Mutex<Option<String>> = Mutex::new(None);

/// Keeps panics off the standard error of the host; [`guarded`] reports them. This library links a
/// standard library of its own, so the hook affects no other code.
pub fn silence_panics() {
    panic::set_hook(Box::new(|info| {
        let place = info.location().map(|l| format!(" ({}:{})", l.file(), l.line()));
        *PANIC_PLACE.lock().unwrap_or_else(PoisonError::into_inner) = place;
    }));
}

fn take_panic_place() -> String {
    PANIC_PLACE.lock().unwrap_or_else(PoisonError::into_inner).take().unwrap_or_default()
}

/// Collects the errors of the GDAL functions that are called while it lives, on its own thread,
/// which it cannot leave.
pub struct Collector(Box<RefCell<Vec<Caught>>>, PhantomData<*const ()>);

struct Caught {
    class: CPLErr::Type,
    number: CPLErrorNum,
    message: String,
}

impl Collector {
    pub fn new() -> Self {
        let caught = Box::new(RefCell::new(Vec::new()));
        let user_data = (&raw const *caught).cast_mut().cast();
        // SAFETY: the box keeps its address and lives until the handler is popped in `drop`.
        unsafe {
            gdal_sys::CPLPushErrorHandlerEx(Some(collect), user_data);
            gdal_sys::CPLSetCurrentErrorHandlerCatchDebug(0); // those of CPL_DEBUG go their way
        }
        Collector(caught, PhantomData)
    }

    /// Returns the first failure since the last [`Collector::clear`].
    pub fn first_failure(&self) -> Option<String> {
        let caught = self.0.borrow();
        caught.iter().find(|e| e.class == CPLErr::CE_Failure).map(|e| e.message.clone())
    }

    /// Discards the collected errors.
    pub fn clear(&self) {
        self.0.borrow_mut().clear();
    }

    /// Ends collecting and emits the collected errors.
    pub fn release(self) {
        let caught = self.0.take();
        drop(self);
        for error in caught {
            emit(error.class, error.number, &error.message);
        }
    }
}

impl Drop for Collector {
    fn drop(&mut self) {
        // SAFETY: pops the handler that `new` pushed: collectors are nested like their scopes.
        unsafe {
            gdal_sys::CPLPopErrorHandler();
            gdal_sys::CPLErrorReset();
        }
    }
}

/// Silences GDAL on this thread until [`unhush`].
pub fn hush() {
    // SAFETY: GDAL's own handler, which lives as long as GDAL does.
    unsafe { gdal_sys::CPLPushErrorHandler(Some(gdal_sys::CPLQuietErrorHandler)) };
}

/// Ends the silence that [`hush`] began on the same thread.
pub fn unhush() {
    // SAFETY: pops the handler that `hush` pushed; without one, GDAL does nothing.
    unsafe { gdal_sys::CPLPopErrorHandler() };
}

/// Fails with the error that GDAL reported during `what`, unless `error` is none.
pub fn check(error: OGRErr::Type, what: impl FnOnce() -> String, collector: &Collector) -> Result<()> {
    match error {
        OGRErr::OGRERR_NONE => Ok(()),
        _ => Err(failure(what(), collector)),
    }
}

/// Creates the failure of `what` with GDAL's reason.
pub fn failure(what: String, collector: &Collector) -> Error {
    let reason = collector.first_failure().unwrap_or_else(|| "GDAL gives no reason".into());
    Error::Writing { what, reason }
}

unsafe extern "C" fn collect(class: CPLErr::Type, number: CPLErrorNum, message: *const c_char) {
    // SAFETY: GDAL calls handlers with a C string; the user data is that of `Collector::new`,
    // whose box lives as long as this handler is installed.
    unsafe {
        let caught = &*gdal_sys::CPLGetErrorHandlerUserData().cast::<RefCell<Vec<Caught>>>();
        if let Ok(mut caught) = caught.try_borrow_mut() {
            let message = CStr::from_ptr(message).to_string_lossy().into_owned();
            caught.push(Caught { class, number, message });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_failure_and_the_given_value() {
        let collector = Collector::new();
        let value = guarded(7, || panic!("no patch has {} vertices", 3));
        let caught = collector.0.borrow();
        assert_eq!((value, caught.len()), (7, 1));
        assert!(caught[0].message.contains("no patch has 3 vertices"));
        assert_eq!(caught[0].class, CPLErr::CE_Failure);
    }

    #[test]
    fn collected_errors_are_emitted_only_when_released() {
        let outer = Collector::new();
        let inner = Collector::new();
        report(CPLErr::CE_Warning, "careful");
        report(CPLErr::CE_Failure, "broken");
        report(CPLErr::CE_Failure, "still broken");
        assert_eq!(inner.first_failure().as_deref(), Some("broken"));
        assert!(outer.0.borrow().is_empty());
        inner.release();
        let messages: Vec<_> = outer.0.borrow().iter().map(|e| e.message.clone()).collect();
        assert_eq!(messages, ["careful", "broken", "still broken"]);

        let dropped = Collector::new();
        report(CPLErr::CE_Failure, "forgotten");
        drop(dropped);
        assert_eq!(outer.0.borrow().len(), 3);
    }

    #[test]
    fn a_message_with_a_percent_sign_or_a_nul_is_emitted_as_text() {
        let collector = Collector::new();
        report(CPLErr::CE_Failure, "100 %s\0 sure");
        assert_eq!(collector.first_failure().as_deref(), Some("100 %s  sure"));
    }
}
