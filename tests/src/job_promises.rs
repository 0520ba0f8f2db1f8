//! What holds of documents that a farm takes. That they are refused is as good; a broken promise panics.

use ovtigre::farm::{rules::Rules, spec::JobSpec, submit::resolve};
use ovtigre_core::path::expression::language::Language;
use ovtigre_proto::{
    job::{JobPatch, JobRequest},
    lease::{Exchange, LeaseFailure, WorkerJoin},
    scene::SceneContents,
};
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Debug;

/// A document as what it says, which is the same when it is written and read again.
fn kept<T: Serialize + DeserializeOwned + PartialEq + Debug>(bytes: &[u8]) -> Option<T> {
    let document: T = serde_json::from_slice(bytes).ok()?;
    let text = serde_json::to_string(&document).expect("plain data");
    let again: T = serde_json::from_str(&text).expect("it was just written");
    assert_eq!(again, document, "{text}");
    Some(document)
}

/// A request for a job: what is taken has batches for each of its pixels, paths that compile, and is the same from the
/// store; what is refused says where and why.
pub fn job(bytes: &[u8]) {
    let Ok(request) = serde_json::from_slice::<JobRequest>(bytes) else { return };
    let scene = SceneContents {
        cameras: vec!["front".to_owned()],
        camera_aspect_ratios: vec![Some(2.0)],
        ..SceneContents::default()
    };
    match resolve(request, &scene, &Rules::default()) {
        Ok(spec) => {
            let text = serde_json::to_vec(&spec).expect("plain data");
            assert!(kept::<JobSpec>(&text).is_some_and(|stored| stored == spec));
            let schedule = spec.schedule();
            let pixels: usize = schedule.regions().iter().map(|region| region.pixels()).sum();
            assert_eq!(pixels, spec.region.pixels());
            assert!(
                schedule.batches() > 0 && spec.samples_asked() > 0 && spec.region.is_in(spec.settings.size)
            );
            assert!(Language::compile(&[&spec.settings.paths]).is_ok());
        }
        Err(faults) => {
            assert!(!faults.is_empty());
            for fault in faults {
                assert!(
                    !fault.detail.is_empty() && (fault.pointer.is_empty() || fault.pointer.starts_with('/'))
                );
            }
        }
    }
}

/// Any document of the REST interface.
pub fn document(bytes: &[u8]) {
    job(bytes);
    drop(serde_json::from_slice::<JobPatch>(bytes));
    drop(serde_json::from_slice::<Exchange>(bytes));
    drop(serde_json::from_slice::<LeaseFailure>(bytes));
    drop(serde_json::from_slice::<WorkerJoin>(bytes));
}
