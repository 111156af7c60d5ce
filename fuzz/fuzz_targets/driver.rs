//! Calls of GDAL's C interface on the driver, in any order and with any values: every failure is one
//! error, no panic is caught inside, and a dataset that closes without an error is complete.
#![no_main]

mod driver_calls;
mod input;

use driver_calls::{Host, register};
use input::Input;
use libfuzzer_sys::fuzz_target;
use std::sync::Once;

fuzz_target!(|bytes: &[u8]| {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(register);
    let mut input = Input(bytes);
    let mut host = Host::new();
    while !input.0.is_empty() {
        host.call(&mut input);
    }
    host.close();
});
