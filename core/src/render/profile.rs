//! On which processors the same batch gives the same bits.

/// Class of processors this program is compiled for. Sums of the same batch are compared, bit for bit, between
/// workers of one class and one version of the program.
pub const NUMERIC_PROFILE: &str =
    if cfg!(all(target_arch = "x86_64", target_feature = "avx2", target_feature = "fma")) {
        "x86-64-v3"
    } else if cfg!(target_arch = "x86_64") {
        "x86-64"
    } else if cfg!(target_arch = "aarch64") {
        "aarch64"
    } else {
        "portable"
    };
