//! What every store does with lists of jobs.

use super::contract::{LONG, batch, claim, id, join, new_job, with_job};
use super::{
    Store,
    list::{JobFilter, Key, Mark, Order, Place, Standing, Way},
    row::{Claim, JobChange, JobRow, NewCheckpoint, NewJob, Progress},
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
    for by in [Key::Created, Key::Name, Key::State, Key::Priority] {
        for state in [None, Some(JobState::Paused), Some(JobState::Queued), Some(JobState::Done)] {
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
    // A place stays when its job does not.
    let order = Order { by: Key::Name, way: Way::Up };
    let rows = store.jobs(JobFilter { order, limit: 2, ..JobFilter::default() }).await.unwrap();
    let after = Some(Place::of(&rows[1], Key::Name));
    assert!(store.remove_job(&rows[1].id).await.unwrap());
    let text = Some("AL".to_owned());
    let rest = store.jobs(JobFilter { order, after, text, limit: 9, ..JobFilter::default() }).await.unwrap();
    assert_eq!((rest.len(), rest[0].name.as_str()), (1, "alpha"));
}

pub(super) async fn a_list_says_how_jobs_stand(store: &dyn Store) {
    let [a, b, c] = [with_job(store, "a").await, with_job(store, "b").await, with_job(store, "c").await];
    store.add_worker(&id("w"), join()).await.unwrap();
    let mut claims: Vec<Claim> = (0..3).map(|n| claim("b", &format!("l{n}"), batch(0, 0, n))).collect();
    claims[2].worker = id("v");
    store.claim(claims, LONG).await.unwrap();
    let mandate = store.take_merge(&a, "m", LONG).await.unwrap().unwrap();
    for look in 1..=3 {
        let seconds = f64::from(look);
        let row = CurveRow {
            samples: look,
            wall_seconds: seconds,
            worker_seconds: seconds,
            rays: 1,
            rms_error: None,
            relative_error: Some(0.5 / seconds),
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
        let checkpoint = NewCheckpoint { look, row, layers, progress: Progress::default() };
        store.add_checkpoint(&a, mandate, checkpoint).await.unwrap();
    }
    let stand = store.standings(&[c.clone(), a.clone(), b, id("none"), a.clone()]).await.unwrap();
    let (nothing, latest) = (Standing::default(), store.curve(&a).await.unwrap().pop());
    assert_eq!((&stand[0], &stand[3]), (&nothing, &nothing));
    assert_eq!((&stand[1].latest, stand[1].latest.is_some(), stand[1].workers), (&latest, true, 0));
    assert_eq!(stand[1].layers, store.layers(&a).await.unwrap());
    assert_eq!((&stand[4], stand[2].workers), (&stand[1], 2));
    assert!(store.standings(&[]).await.unwrap().is_empty());
}
