//! What every store does with lists of jobs.

use super::contract::{LONG, batch, claim, id, join, new_job, with_job};
use super::{
    Store,
    list::{JobFilter, Key, Mark, NEVER, Order, Outlook, Place, Ranks, Standing, Way},
    row::{Claim, Extension, JobChange, JobRow, Mandate, NewCheckpoint, NewJob, Progress, Settlement},
};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    status::JobState,
};

pub(super) async fn jobs_are_listed_page_by_page(store: &dyn Store) {
    for name in ["a", "b", "c", "d"] {
        with_job(store, name).await;
    }
    let list = async |state, before: Option<i64>, limit| {
        let after = before.map(|sequence| Place { mark: Mark::Nothing, sequence });
        let rows = store.jobs(JobFilter { state, after, limit, ..JobFilter::default() }).await.unwrap();
        rows.into_iter().map(|row| (row.id.to_string(), row.sequence)).collect::<Vec<_>>()
    };
    let page = list(None, None, 3).await;
    assert_eq!(page.iter().map(|(name, _)| name.as_str()).collect::<String>(), "dcb");
    let rest = list(None, Some(page[2].1), 3).await;
    assert_eq!((rest.len(), rest[0].0.as_str()), (1, "a"));
    let change = JobChange { state: Some(JobState::Paused), ..JobChange::default() };
    assert!(store.change_job(&id("c"), 1, change).await.unwrap());
    assert_eq!(list(Some(JobState::Paused), None, 9).await.len(), 1);
    assert_eq!(list(Some(JobState::Queued), None, 9).await.len(), 3);
    for (text, found) in [("C", 1), ("", 4), ("%", 0), ("_", 0), ("'", 0), ("\\", 0)] {
        for (state, least) in [(None, found), (Some(JobState::Paused), found.min(1))] {
            let filter = JobFilter { state, text: Some(text.to_owned()), limit: 9, ..JobFilter::default() };
            assert_eq!(store.jobs(filter).await.unwrap().len(), least, "{text} {state:?}");
        }
    }
    let open: Vec<_> =
        store.unsettled_jobs().await.unwrap().into_iter().map(|row| row.id.to_string()).collect();
    assert_eq!(open, ["a", "b", "c", "d"], "the oldest first");
    assert_eq!(store.unknown_jobs(vec![id("x"), id("b"), id("y")]).await.unwrap(), [id("x"), id("y")]);
    assert_eq!(store.unknown_jobs(Vec::new()).await.unwrap(), []);
    assert_eq!(store.counts().await.unwrap().jobs.iter().map(|(_, n)| n).sum::<u64>(), 4);
    // Capital letters are those of ASCII, whatever a database takes for them.
    let named = NewJob { name: "Öl".to_owned(), ..new_job("e") };
    store.add_job(named, None).await.unwrap();
    for (text, found) in [("Öl", 1), ("ÖL", 1), ("öl", 0)] {
        let filter = JobFilter { text: Some(text.to_owned()), limit: 9, ..JobFilter::default() };
        assert_eq!(store.jobs(filter).await.unwrap().len(), found, "{text}");
    }
}

/// All jobs of a state, fetched in pages of `limit`.
async fn paged(store: &dyn Store, order: Order, state: Option<JobState>, limit: u32) -> Vec<JobRow> {
    let (mut all, mut after) = (Vec::new(), None);
    loop {
        let filter = JobFilter { state, order, after, limit, ..JobFilter::default() };
        let rows = store.jobs(filter).await.unwrap();
        let Some(last) = rows.last() else { return all };
        let place = Place::of(last, order.by);
        // As it goes to a client and comes back.
        after = Some(Place::parse(&place.to_string(), order.by).unwrap());
        all.extend(rows);
    }
}

/// Takes a job's checkpoint.
async fn look(store: &dyn Store, job: &str, look: u32, relative_error: Option<f64>) -> Mandate {
    let (job, seconds) = (id(job), f64::from(look));
    let mandate = store.take_merge(&job, "m", LONG).await.unwrap().unwrap();
    let row = CurveRow {
        samples: look,
        wall_seconds: seconds,
        worker_seconds: seconds,
        rays: 1,
        rms_error: None,
        relative_error,
        relative_error_upper: None,
        target_expected_at_seconds: None,
        doubt: None,
    };
    let layers = vec![LayerError {
        mean_luminance: seconds,
        rms_error: None,
        relative_error: None,
        estimated_bias: None,
    }];
    let checkpoint = NewCheckpoint { look, row, layers, progress: Progress::default(), allocations: None };
    store.add_checkpoint(&job, mandate, checkpoint).await.unwrap();
    mandate
}

pub(super) async fn jobs_are_listed_in_every_order(store: &dyn Store) {
    let jobs = [
        ("a", "beta", 3, None),
        ("b", "Alpha", 0, None),
        ("c", "zoë", 0, Some(JobState::Paused)),
        ("d", "ALPHA", -7, Some(JobState::Cancelled)),
        ("e", "alpha", 3, Some(JobState::Paused)),
        ("f", "b", 3, None),
        ("g", "Éa", i32::MAX, Some(JobState::Paused)),
    ];
    for (job, name, priority, state) in jobs {
        let new = NewJob { name: name.to_owned(), priority, ..new_job(job) };
        store.add_job(new, None).await.unwrap();
        let change = JobChange { state, ..JobChange::default() };
        assert!(state.is_none() || store.change_job(&id(job), 1, change).await.unwrap());
    }
    for (job, error) in [("a", Some(0.25)), ("b", None), ("c", Some(0.01)), ("f", Some(0.25))] {
        look(store, job, 1, error).await;
    }
    let outlook = |job, part, left| Outlook { job: id(job), part, left };
    let claims =
        [("a", "v"), ("a", "w"), ("b", "w")].into_iter().enumerate().map(|(n, (job, worker))| Claim {
            worker: id(worker),
            ..claim(job, &format!("l{n}"), batch(0, 0, u32::from(worker == "w" && job == "a")))
        });
    assert_eq!(store.claim(claims.collect(), LONG).await.unwrap(), [true; 3]);
    store.count_workers().await.unwrap();
    let outlooks = [("a", 0.5, Some(1e300)), ("b", 0.5, Some(9.0)), ("c", 0.75, Some(1.0)), ("f", 0.1, None)];
    store.look_out(outlooks.map(|(job, part, left)| outlook(job, part, left)).into()).await.unwrap();
    let keys = [Key::Error, Key::Progress, Key::Eta, Key::Workers];
    for by in [Key::Created, Key::Name, Key::State, Key::Priority].into_iter().chain(keys) {
        for state in [None, Some(JobState::Paused), Some(JobState::Running), Some(JobState::Done)] {
            let filter = JobFilter { state, limit: 99, ..JobFilter::default() };
            let mut expected = store.jobs(filter).await.unwrap();
            expected.sort_by_key(|row| {
                let (text, number) = match Place::of(row, by).mark {
                    Mark::Nothing => (String::new(), 0),
                    Mark::Text(text) => (text, 0),
                    Mark::Number(number) => (String::new(), number),
                };
                (text, number, row.sequence)
            });
            let names = |rows: &[JobRow]| rows.iter().map(|row| row.id.to_string()).collect::<String>();
            for way in [Way::Up, Way::Down] {
                for limit in [1, 2, 3, 99] {
                    let rows = paged(store, Order { by, way }, state, limit).await;
                    assert_eq!(names(&rows), names(&expected), "{by:?} {way:?} {state:?} by {limit}");
                }
                expected.reverse();
            }
        }
    }
    // Those of which it is not known come last, and those alike as they came.
    for (by, expected) in keys.into_iter().zip(["cafbdeg", "degfabc", "bacdefg", "cdefgba"]) {
        let order = Order { by, way: Way::Up };
        let rows = store.jobs(JobFilter { order, limit: 99, ..JobFilter::default() }).await.unwrap();
        assert_eq!(rows.iter().map(|row| row.id.to_string()).collect::<String>(), expected, "{by:?}");
    }
    // A place stays when its job does not.
    let order = Order { by: Key::Name, way: Way::Up };
    let rows = store.jobs(JobFilter { order, limit: 2, ..JobFilter::default() }).await.unwrap();
    let after = Some(Place::of(&rows[1], Key::Name));
    assert!(store.remove_job(&rows[1].id).await.unwrap());
    let text = Some("AL".to_owned());
    let rest = store.jobs(JobFilter { order, after, text, limit: 9, ..JobFilter::default() }).await.unwrap();
    assert_eq!((rest.len(), rest[0].name.as_str()), (1, "alpha"));
}

pub(super) async fn what_lists_go_by_follows_a_job(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let row = async || store.job(&job).await.unwrap().unwrap();
    let nothing = Ranks { error_ppb: NEVER, part_ppb: 0, expected_ms: NEVER, workers: 0 };
    assert_eq!(row().await.ranks, nothing);
    assert_eq!(store.run_times(&[job.clone(), id("none")]).await.unwrap(), [None, None]);
    let outlook = || vec![Outlook { job: job.clone(), part: 0.25, left: Some(60.0) }];
    // It does not run yet: its end is not expected.
    store.look_out(outlook()).await.unwrap();
    assert_eq!(row().await.ranks, Ranks { part_ppb: 250_000_000, ..nothing });
    let mut claims: Vec<Claim> = (0..3).map(|n| claim("a", &format!("l{n}"), batch(0, 0, n))).collect();
    claims[1].worker = id("v");
    store.claim(claims, LONG).await.unwrap();
    assert_eq!(row().await.ranks.workers, 0);
    store.count_workers().await.unwrap();
    store.look_out(outlook()).await.unwrap();
    let begun = row().await;
    assert_eq!(begun.ranks.workers, 2);
    let seconds = store.run_times(std::slice::from_ref(&job)).await.unwrap()[0].unwrap();
    assert!((begun.run_seconds..60.0).contains(&seconds), "{seconds}");
    let end = begun.started_at.unwrap().as_millisecond() + 60_000;
    assert!((end..end + 60_000).contains(&begun.ranks.expected_ms), "{begun:?}");
    // Workers go by and by; a pause leaves no end to expect.
    store.release(&id("l1"), None).await.unwrap();
    store.count_workers().await.unwrap();
    assert_eq!(row().await.ranks.workers, 1);
    let mandate = look(store, "a", 1, Some(0.5)).await;
    let change = |state| JobChange { state, ..JobChange::default() };
    assert!(store.change_job(&job, row().await.version, change(Some(JobState::Paused))).await.unwrap());
    let paused = Ranks { error_ppb: 500_000_000, workers: 1, ..row().await.ranks };
    assert_eq!(paused, Ranks { part_ppb: 250_000_000, ..paused });
    assert_eq!((row().await.ranks, paused.expected_ms), (paused, NEVER));
    // Over: nobody works at it, whatever comes late.
    let settlement =
        Settlement { mandate, progress: Progress::default(), part: 1.0, manifest: None, certified: false };
    let done = JobChange { settlement: Some(settlement), ..change(Some(JobState::Done)) };
    assert!(store.change_job(&job, row().await.version, done).await.unwrap());
    store.look_out(outlook()).await.unwrap();
    store.count_workers().await.unwrap();
    let over = Ranks { part_ppb: 1_000_000_000, error_ppb: 500_000_000, ..nothing };
    assert_eq!(row().await.ranks, over);
    // It goes on without the checkpoint.
    let to = Extension { spec: "{}".to_owned(), whole: 0, looks: 0, regions: 2, replicates: 2 };
    assert!(store.extend_job(&job, row().await.version, to).await.unwrap());
    assert_eq!(row().await.ranks.error_ppb, NEVER);
}

pub(super) async fn a_list_says_how_jobs_stand(store: &dyn Store) {
    let [a, b, c] = [with_job(store, "a").await, with_job(store, "b").await, with_job(store, "c").await];
    store.add_worker(&id("w"), join()).await.unwrap();
    let mut claims: Vec<Claim> = (0..3).map(|n| claim("b", &format!("l{n}"), batch(0, 0, n))).collect();
    claims[2].worker = id("v");
    store.claim(claims, LONG).await.unwrap();
    for number in 1..=3 {
        look(store, "a", number, Some(0.5 / f64::from(number))).await;
    }
    let stand = store.standings(&[c.clone(), a.clone(), b, id("none"), a.clone()]).await.unwrap();
    let (nothing, latest) = (Standing::default(), store.curve(&a).await.unwrap().pop());
    assert_eq!((&stand[0], &stand[3]), (&nothing, &nothing));
    assert_eq!((&stand[1].latest, stand[1].latest.is_some(), stand[1].workers), (&latest, true, 0));
    assert_eq!(stand[1].layers, store.layers(&a).await.unwrap());
    assert_eq!((&stand[4], stand[2].workers), (&stand[1], 2));
    assert!(store.standings(&[]).await.unwrap().is_empty());
}
