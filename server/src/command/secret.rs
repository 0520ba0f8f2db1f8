//! What nobody can guess.

use super::exit::{CommandError, Outcome};
use std::{fmt::Write as _, fs::File, io::Read as _};

/// A token: 256 bits from the operating system.
pub(crate) fn token() -> Outcome<String> {
    let mut bytes = [0; 32];
    let read = File::open("/dev/urandom").and_then(|mut file| file.read_exact(&mut bytes));
    read.map_err(|e| CommandError::failed(format!("the system gives no random numbers: {e}")))?;
    let mut text = "ovt_".to_owned();
    for byte in bytes {
        write!(text, "{byte:02x}").expect("writing to a string cannot fail");
    }
    Ok(text)
}
