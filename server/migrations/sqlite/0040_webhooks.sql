-- Who is told of a job's changes, and what a notice is signed with.
CREATE TABLE webhook (
    job TEXT PRIMARY KEY,
    url TEXT NOT NULL,
    secret TEXT NOT NULL
) STRICT, WITHOUT ROWID;

-- Changes of which somebody is still to be told; those of a job one after another.
CREATE TABLE notice (
    sequence INTEGER PRIMARY KEY AUTOINCREMENT,
    job TEXT NOT NULL,
    state TEXT NOT NULL,
    reason TEXT,
    changed_ms INTEGER NOT NULL,
    tries INTEGER NOT NULL,
    due_ms INTEGER NOT NULL
) STRICT;

CREATE INDEX notice_by_time ON notice (due_ms);
CREATE INDEX notice_by_job ON notice (job, sequence);
