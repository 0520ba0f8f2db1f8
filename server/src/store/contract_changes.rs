//! What every store does with what is undone, extended and let in.

use super::contract::{LONG, NOW, batch, claim, commit, hash, id, join, new_job, with_job};
use super::{
    Store,
    notice::Webhook,
    row::{CommitOutcome, Extension, JobChange, Lane, NewJob, Progress, Role, Settlement, TokenRow},
};
use ovtigre_proto::status::{JobState, WorkerState};

pub(super) async fn what_was_brought_is_taken_back(store: &dyn Store) {
    let job = with_job(store, "a").await;
    store.add_worker(&id("w"), join()).await.unwrap();
    let claims = vec![claim("a", "l1", batch(0, 0, 0)), claim("a", "l2", batch(0, 0, 1))];
    store.claim(claims, LONG).await.unwrap();
    store.commit(commit("a", batch(0, 0, 0), 1)).await.unwrap();
    store.commit(commit("a", batch(0, 0, 1), 1)).await.unwrap();
    let mine = store.commits_by(&id("w")).await.unwrap();
    assert_eq!(mine.len(), 2);
    assert!(mine.contains(&(job.clone(), batch(0, 0, 1))));
    let mandate = store.take_merge(&job, "m", LONG).await.unwrap().unwrap();
    let lane = Lane { replicate: 0, region: 0 };
    store.set_snapshot(&job, mandate, lane, 1).await.unwrap();
    let back = vec![batch(0, 0, 1), batch(1, 1, 0)];
    store.uncommit(&job, back.clone(), vec![lane]).await.unwrap();
    store.uncommit(&job, back, vec![lane]).await.unwrap();
    let ledger = store.ledger(&job).await.unwrap();
    assert_eq!(ledger.returned, [batch(0, 0, 1)], "only what was brought comes back");
    assert_eq!((ledger.commits.len(), ledger.snapshots.len()), (1, 0));
    assert_eq!(store.claim(vec![claim("a", "l3", batch(0, 0, 1))], LONG).await.unwrap(), [true]);
    assert_eq!(store.commit(commit("a", batch(0, 0, 1), 2)).await.unwrap(), CommitOutcome::First);
    store.free_merge(&job).await.unwrap();
    assert!(store.set_snapshot(&job, mandate, lane, 2).await.is_err(), "who appended has to begin again");
    assert_eq!(store.pin_job(&job, "x").await.unwrap().as_deref(), Some("x"));
    assert_eq!(store.pin_job(&job, "y").await.unwrap().as_deref(), Some("x"));
    assert_eq!(store.job(&job).await.unwrap().unwrap().class.as_deref(), Some("x"));
    assert_eq!(store.pin_job(&id("none"), "y").await.unwrap(), None);
}

pub(super) async fn changes_of_a_job_are_told_of_in_order(store: &dyn Store) {
    let webhook = Webhook { url: "there".to_owned(), secret: "s".to_owned() };
    store.add_job(NewJob { webhook: Some(webhook.clone()), ..new_job("a") }, None).await.unwrap();
    with_job(store, "b").await;
    assert!(store.due_notices(9, LONG).await.unwrap().is_empty(), "who sent a job knows of it");
    let both = vec![claim("a", "l1", batch(0, 0, 0)), claim("b", "l2", batch(0, 0, 0))];
    store.claim(both, LONG).await.unwrap();
    let job = id("a");
    let version = store.job(&job).await.unwrap().unwrap().version;
    let stop =
        JobChange { state: Some(JobState::Cancelled), reason: Some("no".to_owned()), ..JobChange::default() };
    assert!(store.change_job(&job, version, stop).await.unwrap());
    let first = store.due_notices(9, NOW).await.unwrap();
    assert_eq!((first.len(), first[0].state, first[0].tries), (1, JobState::Running, 1));
    let again = store.due_notices(9, LONG).await.unwrap();
    assert_eq!((again.len(), again[0].sequence, again[0].tries), (1, first[0].sequence, 2));
    assert!(store.due_notices(9, LONG).await.unwrap().is_empty(), "who took it has it for a while");
    store.put_off_notice(first[0].sequence, NOW).await.unwrap();
    assert_eq!(store.due_notices(9, LONG).await.unwrap()[0].tries, 3);
    store.end_notice(first[0].sequence).await.unwrap();
    let next = store.due_notices(9, NOW).await.unwrap();
    assert_eq!((next.len(), next[0].state, next[0].reason.as_deref()), (1, JobState::Cancelled, Some("no")));
    assert_eq!((&next[0].job, next[0].name.as_str(), &next[0].webhook), (&job, "job a", &webhook));
    store.remove_job(&job).await.unwrap();
    assert!(store.due_notices(9, NOW).await.unwrap().is_empty(), "nobody is told of what is forgotten");
}

pub(super) async fn a_job_is_extended(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let extension = |whole| Extension { spec: "{1}".to_owned(), whole, looks: 0, regions: 2, replicates: 2 };
    let claims = (0..3).map(|n| claim("a", &format!("l{n}"), batch(0, 0, n))).collect();
    store.claim(claims, LONG).await.unwrap();
    for n in 0..2 {
        store.commit(commit("a", batch(0, 0, n), 1)).await.unwrap();
    }
    let version = store.job(&job).await.unwrap().unwrap().version;
    assert!(!store.extend_job(&job, version + 1, extension(1)).await.unwrap());
    assert!(store.extend_job(&job, version, extension(1)).await.unwrap());
    let row = store.job(&job).await.unwrap().unwrap();
    assert_eq!((row.spec.as_str(), row.version, row.state), ("{1}", version + 1, JobState::Running));
    let ledger = store.ledger(&job).await.unwrap();
    assert_eq!((ledger.commits.len(), ledger.leases.len()), (1, 0), "past the first block all is forgotten");
    assert!(ledger.cursors.contains(&(Lane { replicate: 0, region: 0 }, 1)));
    // One that is over goes on at what is kept of each lane.
    let mandate = store.take_merge(&job, "m", LONG).await.unwrap().unwrap();
    store.set_snapshot(&job, mandate, Lane { replicate: 0, region: 0 }, 1).await.unwrap();
    let settlement =
        Settlement { mandate, progress: Progress::default(), part: 1.0, manifest: None, certified: false };
    let over =
        JobChange { state: Some(JobState::Done), settlement: Some(settlement), ..JobChange::default() };
    assert!(store.change_job(&job, row.version, over).await.unwrap());
    assert!(store.extend_job(&job, row.version + 1, extension(9)).await.unwrap());
    let row = store.job(&job).await.unwrap().unwrap();
    assert_eq!((row.state, row.settled, row.ended_at), (JobState::Queued, false, None));
    let ledger = store.ledger(&job).await.unwrap();
    let mut cursors: Vec<u32> = ledger.cursors.iter().map(|(_, block)| *block).collect();
    cursors.sort_unstable();
    assert_eq!(cursors, [0, 0, 0, 1]);
    assert_eq!((ledger.commits.len(), ledger.snapshots.len()), (1, 1));
    assert_eq!(store.unsettled_jobs().await.unwrap().len(), 1);
}

pub(super) async fn tokens_and_workers_put_aside_are_remembered(store: &dyn Store) {
    let token = |n: u8, role| TokenRow {
        id: format!("t{n}"),
        name: "anna".to_owned(),
        role,
        hash: hash(n),
        created_at: None,
    };
    assert!(store.tokens().await.unwrap().is_empty());
    for (n, role) in (0..).zip(Role::ALL) {
        store.add_token(token(n, role)).await.unwrap();
    }
    assert!(store.add_token(token(0, Role::Read)).await.is_err(), "a token is there once");
    let found = store.token(&hash(3)).await.unwrap().unwrap();
    assert_eq!((found.role, found.name.as_str(), found.created_at.is_some()), (Role::Work, "anna", true));
    assert!(store.token(&hash(9)).await.unwrap().is_none());
    assert!(store.remove_token("t3").await.unwrap() && !store.remove_token("t3").await.unwrap());
    assert_eq!(store.tokens().await.unwrap().len(), 3);
    assert!(store.token(&hash(3)).await.unwrap().is_none());
    store.add_worker(&id("w"), join()).await.unwrap();
    assert!(store.set_aside(&id("w"), "it lies").await.unwrap());
    assert!(!store.set_aside(&id("none"), "it lies").await.unwrap());
    let seen = store.see_worker(&id("w"), WorkerState::Active).await.unwrap();
    assert_eq!(seen, Some(WorkerState::Aside), "by a beat it does not come back");
    assert_eq!(store.worker(&id("w")).await.unwrap().unwrap().reason.as_deref(), Some("it lies"));
    assert!(store.lose_workers(NOW).await.unwrap().is_empty());
}
