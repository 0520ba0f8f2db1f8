//! A bucket of an S3-compatible service.

use super::{BlobError, Result};
use object_store::{
    ClientOptions, RetryConfig,
    aws::{AmazonS3, AmazonS3Builder, AmazonS3ConfigKey},
    path::Path as Key,
};
use std::time::Duration;

/// A request that failed and may be repeated is, for so long.
const RETRY: Duration = Duration::from_secs(20);
/// A request without an answer is given up after.
const PATIENCE: Duration = Duration::from_mins(2);

/// The bucket and the common beginning of names of `s3://bucket/prefix`. Keys, region and endpoint are
/// those of the environment: `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`,
/// `AWS_ENDPOINT_URL` and the others that the service's own programs read.
pub(super) fn open(url: &str) -> Result<(AmazonS3, Key)> {
    let address = url.strip_prefix("s3://").filter(|rest| !rest.is_empty() && !rest.starts_with('/'));
    let address = address.ok_or_else(|| BlobError::Address(url.to_owned()))?;
    let (bucket, prefix) = address.split_once('/').unwrap_or((address, ""));
    let prefix = Key::parse(prefix.trim_matches('/')).map_err(|_| BlobError::Address(url.to_owned()))?;
    ovtigre_proto::client::tls::provide();
    let retry = RetryConfig { max_retries: 6, retry_timeout: RETRY, ..RetryConfig::default() };
    let builder = AmazonS3Builder::from_env().with_bucket_name(bucket).with_retry(retry);
    let endpoint = builder.get_config_value(&AmazonS3ConfigKey::Endpoint);
    let plain = endpoint.is_some_and(|endpoint| endpoint.starts_with("http://"));
    let client = ClientOptions::new().with_timeout(PATIENCE).with_allow_http(plain);
    Ok((builder.with_client_options(client).build()?, prefix))
}
