-- Who is told of a job's changes, and what a notice is signed with.
CREATE TABLE webhook (
    job TEXT PRIMARY KEY,
    url TEXT NOT NULL,
    secret TEXT NOT NULL
);

-- Changes of which somebody is still to be told; those of a job one after another.
CREATE TABLE notice (
    sequence BIGINT GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
    job TEXT NOT NULL,
    state TEXT NOT NULL,
    reason TEXT,
    changed_ms BIGINT NOT NULL,
    tries BIGINT NOT NULL,
    due_ms BIGINT NOT NULL
) WITH (fillfactor = 70);

CREATE INDEX notice_by_time ON notice (due_ms);
CREATE INDEX notice_by_job ON notice (job, sequence);
