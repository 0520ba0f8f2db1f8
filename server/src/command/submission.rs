//! From flags to a job on a farm, and from a job to files.

use super::{
    exit::{CommandError, Outcome},
    job_flags::JobFlags,
    output::{Output, check_writable},
    report, scene_file, terminal,
    truth::Truth,
    words,
};
use ovtigre_proto::{
    client::{error::ClientError, farm::Client, file::Upload},
    job::JobRequest,
    pair::{EnvironmentRequest, radiance},
    scene::SceneContent,
    status::{JobState, JobStatus},
};
use std::{
    path::{Path, PathBuf},
    time::SystemTime,
};

/// What is read and checked on this side before anything is started.
#[derive(Debug)]
pub(crate) struct Submission {
    path: PathBuf,
    scene: Upload,
    environment: Option<Environment>,
    flags: JobFlags,
    name: String,
    pub(crate) output: Output,
    /// What the pictures so far are compared with.
    pub(crate) truth: Option<Truth>,
}

#[derive(Debug)]
enum Environment {
    Uniform([f32; 3]),
    Image(PathBuf, Upload),
}

impl Submission {
    /// Reads the scene and all that the flags name.
    pub(crate) async fn read(scene: &Path, flags: JobFlags) -> Outcome<Self> {
        let output = Output::new(flags.output.as_deref(), scene)?;
        for file in flags.report.iter().chain(&flags.plot) {
            check_writable(file)?;
        }
        let truth = flags.reference.as_deref().map(Truth::read).transpose()?;
        let environment = match &flags.environment {
            None => None,
            Some(text) => Some(environment(text).await?),
        };
        let name = scene.file_stem().unwrap_or(scene.as_os_str()).to_string_lossy().into_owned();
        let path = scene.to_owned();
        Ok(Self { path, scene: scene_file::read(scene).await?, environment, flags, name, output, truth })
    }

    /// Uploads what the farm does not have, and submits.
    pub(crate) async fn submit(&self, client: &Client) -> Outcome<JobStatus> {
        client.upload(&self.scene).await.map_err(|e| unreadable(&self.path, e))?;
        let environment = match &self.environment {
            None => None,
            Some(Environment::Uniform(radiance)) => Some(EnvironmentRequest::Uniform(*radiance)),
            Some(Environment::Image(path, image)) => {
                let report = client.upload(image).await.map_err(|e| no_image(path, e))?;
                if let SceneContent::Scene(_) = report.content {
                    return Err(CommandError::wrong(format!(
                        "environment {}: it is a scene; give an image (.exr or .hdr)",
                        path.display()
                    )));
                }
                Some(EnvironmentRequest::Image(image.id().clone()))
            }
        };
        let request = self.flags.request(self.name.clone(), self.scene.id().clone(), environment);
        Ok(client.submit(&request, &key(&request)).await?)
    }

    /// Fetches the picture and the report of a job that is over, and says how it ended.
    pub(crate) async fn collect(
        &self,
        client: &Client,
        status: &JobStatus,
        truth: Option<&Truth>,
    ) -> Outcome {
        if status.state == JobState::Failed {
            let reason = status.reason.as_deref().unwrap_or("the farm does not say why");
            return Err(CommandError::failed(format!("the job failed: {reason}")));
        }
        let exr = client.image(&status.id, None, None).await.map_err(|error| match error.status() {
            Some(404) if status.state == JobState::Cancelled => {
                CommandError::stopped("stopped before there was a picture")
            }
            _ => error.into(),
        })?;
        self.output.write(exr, client, &status.id).await?;
        let files = report::Files { report: self.flags.report.as_deref(), plot: self.flags.plot.as_deref() };
        report::write(client, status, truth, &self.output.exr, &files).await?;
        terminal::result(&words::list(&[
            self.output.png.as_ref().unwrap_or(&self.output.exr).display().to_string(),
            words::samples(status),
            words::error(status),
            words::duration(status.wall_seconds),
        ]));
        if let Some(target) =
            status.error_target.filter(|_| !status.certified && status.state == JobState::Done)
        {
            let doubt = status.error.as_ref().and_then(|row| row.doubt.as_ref());
            let why = match (doubt, status.settings.method) {
                (_, method) if method.has_bias() => {
                    format!("{} has a bias that the spread of samples does not show", method.name())
                }
                (Some(doubt), _) => doubt.to_string(),
                (None, _) => "it needs more samples".to_owned(),
            };
            terminal::remark(&format!("warning: the error is not certified to be under {target}: {why}"));
        }
        match status.state {
            JobState::Done => Ok(()),
            _ => Err(CommandError::stopped("stopped before done; the picture so far is written")),
        }
    }

    /// Whether there is something to do when the job is over.
    pub(crate) fn wants_files(&self) -> bool {
        self.flags.output.is_some() || self.flags.report.is_some() || self.flags.plot.is_some()
    }
}

async fn environment(text: &str) -> Outcome<Environment> {
    if let Some(radiance) = radiance(text) {
        return Ok(Environment::Uniform(radiance));
    }
    let path = PathBuf::from(text);
    if text.contains(',') && !path.exists() {
        let wrong = format!("environment '{text}' is neither a file nor three numbers R,G,B from 0 on");
        return Err(CommandError::wrong(wrong));
    }
    if !path.is_file() {
        let reason = if path.exists() { "it is not a plain file" } else { "there is no such file" };
        return Err(CommandError::wrong(format!("environment {}: {reason}", path.display())));
    }
    let upload = Upload::file(path.clone()).await?;
    Ok(Environment::Image(path, upload))
}

/// Tells this submission from any other, and not from its own repetition.
fn key(request: &JobRequest) -> String {
    let now = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_nanos();
    let text = serde_json::to_string(request).expect("a request is plain data");
    let hash = blake3::hash(format!("{}-{now}-{text}", std::process::id()).as_bytes());
    hash.to_hex().as_str()[..32].to_owned()
}

/// What the farm says of an environment that it cannot read.
fn no_image(path: &Path, error: ClientError) -> CommandError {
    let ClientError::Problem(problem) = &error else { return error.into() };
    let detail = problem.errors.first().map_or(&problem.detail, |found| &found.detail);
    if problem.status < 500 {
        let path = path.display();
        CommandError::wrong(format!(
            "environment {path}: not an image to light with (.exr or .hdr): {detail}"
        ))
    } else {
        error.into()
    }
}

/// What the farm says of a scene that it cannot read, in the name that the scene has here.
fn unreadable(path: &Path, error: ClientError) -> CommandError {
    match &error {
        ClientError::Problem(problem) if problem.status < 500 => match problem.errors.first() {
            Some(found) => scene_file::fault(path, &found.detail),
            None => error.into(),
        },
        _ => error.into(),
    }
}
