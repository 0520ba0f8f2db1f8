-- Lists of jobs by what changes while a job is rendered: the relative error at its latest checkpoint and the part of its samples
-- that is drawn, in billionths; when it is expected to be done; workers that hold batches of it. What is not known is 9·10¹⁸.
ALTER TABLE job ADD COLUMN error_ppb BIGINT NOT NULL DEFAULT 9000000000000000000;
ALTER TABLE job ADD COLUMN part_ppb BIGINT NOT NULL DEFAULT 0;
ALTER TABLE job ADD COLUMN expected_ms BIGINT NOT NULL DEFAULT 9000000000000000000;
ALTER TABLE job ADD COLUMN workers BIGINT NOT NULL DEFAULT 0;
UPDATE job SET error_ppb = coalesce(
    (SELECT CASE WHEN relative_error < 1e9 THEN CAST(round(relative_error * 1e9) AS BIGINT) END
     FROM checkpoint WHERE checkpoint.job = job.id ORDER BY look DESC LIMIT 1),
    9000000000000000000);
-- A document that holds the character zero is no JSONB.
UPDATE job SET part_ppb = CASE WHEN state = 'done' THEN 1000000000 WHEN position('\u0000' IN spec) > 0 THEN 0 ELSE CAST(1e9 * least(1.0, coalesce(
    CAST(CAST(progress AS JSONB)->>'samples' AS DOUBLE PRECISION)
        / nullif(CAST(CAST(spec AS JSONB)->>'samples' AS DOUBLE PRECISION)
            * CAST(CAST(spec AS JSONB)->'settings'->>'replicates' AS DOUBLE PRECISION), 0),
    0)) AS BIGINT) END;
CREATE INDEX job_by_error ON job (error_ppb, sequence);
CREATE INDEX job_by_state_and_error ON job (state, error_ppb, sequence);
CREATE INDEX job_by_part ON job (part_ppb, sequence);
CREATE INDEX job_by_state_and_part ON job (state, part_ppb, sequence);
CREATE INDEX job_by_expected ON job (expected_ms, sequence);
CREATE INDEX job_by_state_and_expected ON job (state, expected_ms, sequence);
CREATE INDEX job_by_workers ON job (workers, sequence);
CREATE INDEX job_by_state_and_workers ON job (state, workers, sequence);
