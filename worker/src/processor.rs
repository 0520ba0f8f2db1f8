//! Whether this processor can run this build.

/// What a processor lacks of the x86-64-v3 that builds for x86 are made of; to be asked before
/// anything else runs. One line for the user where something is missing.
pub fn check() -> Result<(), String> {
    let missing = missing();
    if missing.is_empty() {
        return Ok(());
    }
    Err(format!(
        "this processor lacks {}; ovtigre needs x86-64-v3 (Intel from 2013, AMD from 2015), or a build for another kind of processor",
        missing.join(", ")
    ))
}

#[cfg(target_arch = "x86_64")]
fn missing() -> Vec<&'static str> {
    let id = raw_cpuid::CpuId::new();
    let basic = id.get_feature_info();
    let more = id.get_extended_feature_info();
    let late = id.get_extended_processor_and_feature_identifiers();
    let of = |there: Option<bool>, name| (there != Some(true)).then_some(name);
    [
        of(more.as_ref().map(raw_cpuid::ExtendedFeatures::has_avx2), "AVX2"),
        of(basic.as_ref().map(raw_cpuid::FeatureInfo::has_fma), "FMA"),
        of(more.as_ref().map(raw_cpuid::ExtendedFeatures::has_bmi1), "BMI1"),
        of(more.as_ref().map(raw_cpuid::ExtendedFeatures::has_bmi2), "BMI2"),
        of(late.as_ref().map(raw_cpuid::ExtendedProcessorFeatureIdentifiers::has_lzcnt), "LZCNT"),
        of(basic.as_ref().map(raw_cpuid::FeatureInfo::has_movbe), "MOVBE"),
        of(basic.as_ref().map(raw_cpuid::FeatureInfo::has_f16c), "F16C"),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn missing() -> Vec<&'static str> {
    Vec::new()
}
