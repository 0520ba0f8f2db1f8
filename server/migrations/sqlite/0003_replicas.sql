-- Batches brought and checkpoints taken of a job: other servers see by them that there is something to do.
ALTER TABLE job ADD COLUMN brought INTEGER NOT NULL DEFAULT 0;
ALTER TABLE job ADD COLUMN looks INTEGER NOT NULL DEFAULT 0;
UPDATE job SET looks = (SELECT count(*) FROM checkpoint WHERE checkpoint.job = job.id);
-- The place in the order of coming within its job; 0 before there was one.
ALTER TABLE commits ADD COLUMN number INTEGER NOT NULL DEFAULT 0;
CREATE INDEX commits_by_number ON commits (job, number);
-- Nobody asks who brought what of a job that is settled.
DELETE FROM commits WHERE job IN (SELECT id FROM job WHERE settled = 1);
DELETE FROM disagreement WHERE job IN (SELECT id FROM job WHERE settled = 1);

-- Who appends to which job's sums, and how often that has changed.
CREATE TABLE merger (
    job TEXT PRIMARY KEY,
    holder TEXT NOT NULL,
    epoch INTEGER NOT NULL,
    ends_ms INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
