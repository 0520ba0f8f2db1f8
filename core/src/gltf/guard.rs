//! A wall around decoders that others have written.

use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a decoder of bytes from outside makes, or why it cannot. A bug of a decoder refuses a scene; it does not end the
/// process, which may hold other scenes.
pub(crate) fn guarded<T, E: Display>(decode: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(decode)) {
        Ok(Ok(decoded)) => Ok(decoded),
        Ok(Err(error)) => Err(error.to_string().replace('\n', " ")),
        Err(_) => Err("its decoder stumbled over it".to_owned()),
    }
}
