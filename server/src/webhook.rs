//! Notices to other services: checked addresses, signatures, one post each.

use crate::store::notice::{NoticeRow, Webhook};
use base64::{Engine as _, prelude::BASE64_STANDARD};
use ovtigre_proto::{
    client::tls,
    problem::Fault,
    webhook::{Notice, NoticeData, NoticeKind, WebhookRequest},
};
use reqwest::{
    StatusCode, Url,
    dns::{Addrs, Name, Resolve, Resolving},
    redirect::Policy,
};
use ring::hmac;
use std::{
    io,
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    sync::Arc,
    time::Duration,
};

/// Longest address, in bytes.
const URL_MAX: usize = 2000;
/// What a secret begins with.
const SECRET_PREFIX: &str = "whsec_";
/// Bytes of a secret.
const SECRET_BYTES: std::ops::RangeInclusive<usize> = 24..=64;
/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(10);

/// Where notices may be sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reach {
    /// To addresses of the public internet.
    #[default]
    Public,
    /// Also to this machine and to private networks.
    Anywhere,
}

/// What became of a notice that was sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It was taken.
    Taken,
    /// Nobody wants it any more.
    Gone,
    /// It was not taken, and why.
    Failed(String),
}

/// Sends notices.
#[derive(Debug)]
pub struct Messenger {
    client: reqwest::Client,
    reach: Reach,
}

/// Whom to tell, where that is asked for properly; else what is wrong.
pub fn check(request: &WebhookRequest, reach: Reach) -> Result<Webhook, Vec<Fault>> {
    let mut faults = Vec::new();
    let mut note = |pointer: &str, detail: &str| {
        faults.push(Fault { pointer: format!("/webhook{pointer}"), detail: detail.to_owned() });
    };
    if let Err(detail) = address(&request.url, reach) {
        note("/url", detail);
    }
    let secret = request.secret.clone().unwrap_or_default();
    if key(&secret).is_none() {
        note("/secret", "a secret is 'whsec_' and 24 to 64 random bytes in base64");
    }
    if faults.is_empty() { Ok(Webhook { url: request.url.clone(), secret }) } else { Err(faults) }
}

/// What of a webhook is shown: the address without what may be secret in it.
pub fn shown(request: &WebhookRequest) -> WebhookRequest {
    let origin = Url::parse(&request.url).map(|url| url.origin().ascii_serialization());
    WebhookRequest { url: origin.unwrap_or_default(), secret: None }
}

fn address(text: &str, reach: Reach) -> Result<Url, &'static str> {
    if text.len() > URL_MAX {
        return Err("an address has at most 2000 bytes");
    }
    let url = Url::parse(text).map_err(|_| "this is no address: give 'https://HOST/PATH'")?;
    if !matches!(url.scheme(), "http" | "https") {
        return Err("notices are sent by http and https only");
    }
    if !url.username().is_empty() || url.password().is_some() {
        return Err("an address has no user name and no password: notices are signed");
    }
    let host = url.host_str().unwrap_or_default();
    let literal = host.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
    let here = host == "localhost" || host.ends_with(".localhost");
    let private = here || literal.is_ok_and(|ip| !is_public(ip));
    if reach == Reach::Public && private {
        return Err("this address is not public, and this farm sends notices to public ones only");
    }
    Ok(url)
}

fn key(secret: &str) -> Option<hmac::Key> {
    let bytes = BASE64_STANDARD.decode(secret.strip_prefix(SECRET_PREFIX)?).ok()?;
    SECRET_BYTES.contains(&bytes.len()).then(|| hmac::Key::new(hmac::HMAC_SHA256, &bytes))
}

fn sign(key: &hmac::Key, id: &str, seconds: i64, body: &str) -> String {
    let tag = hmac::sign(key, format!("{id}.{seconds}.{body}").as_bytes());
    format!("v1,{}", BASE64_STANDARD.encode(tag))
}

/// Whether an address is one of the public internet, and of one machine.
fn is_public(ip: IpAddr) -> bool {
    match ip {
        IpAddr::V4(ip) => is_public_v4(ip),
        IpAddr::V6(ip) => is_public_v6(ip),
    }
}

fn is_public_v4(ip: Ipv4Addr) -> bool {
    let [a, b, c, _] = ip.octets();
    let special =
        matches!((a, b, c), (0, ..) | (100, 64..=127, _) | (192, 0, 0) | (192, 88, 99) | (198, 18..=19, _));
    let reserved = a >= 224;
    !(special
        || reserved
        || ip.is_loopback()
        || ip.is_private()
        || ip.is_link_local()
        || ip.is_broadcast()
        || ip.is_documentation())
}

fn is_public_v6(ip: Ipv6Addr) -> bool {
    let s = ip.segments();
    let v4 = |high: u16, low: u16| {
        let ([a, b], [c, d]) = (high.to_be_bytes(), low.to_be_bytes());
        is_public_v4(Ipv4Addr::new(a, b, c, d))
    };
    match s {
        // Addresses that hold one of version 4: mapped, translated, 6to4.
        [0, 0, 0, 0, 0, 0xffff, high, low]
        | [0x64, 0xff9b, 0, 0, 0, 0, high, low]
        | [0x2002, high, low, ..] => v4(high, low),
        // Teredo, documentation; of the rest only what is given out to machines.
        [0x2001, 0..=0x1ff | 0xdb8, ..] | [0x3fff, 0..=0xfff, ..] => false,
        [first, ..] => (0x2000..0x4000).contains(&first),
    }
}

/// Names that lead to public addresses only: a name is looked up once, by whoever connects.
#[derive(Debug)]
struct PublicOnly;

impl Resolve for PublicOnly {
    fn resolve(&self, name: Name) -> Resolving {
        Box::pin(async move {
            let found = tokio::net::lookup_host((name.as_str(), 0)).await?;
            let public: Vec<SocketAddr> = found.filter(|at| is_public(at.ip())).collect();
            if public.is_empty() {
                return Err(io::Error::other("its name leads to no public address").into());
            }
            Ok(Box::new(public.into_iter()) as Addrs)
        })
    }
}

impl Messenger {
    /// One that follows no redirection and uses no proxy: neither would be checked.
    pub fn new(reach: Reach) -> reqwest::Result<Self> {
        tls::provide();
        let builder = || {
            let builder = reqwest::Client::builder().redirect(Policy::none()).no_proxy().timeout(PATIENCE);
            let builder = builder.user_agent(concat!("ovtigre/", env!("CARGO_PKG_VERSION")));
            if reach == Reach::Public { builder.dns_resolver(Arc::new(PublicOnly)) } else { builder }
        };
        // A machine that trusts no certificate can still send by http.
        let client = builder().build().or_else(|_| builder().tls_certs_only([]).build())?;
        Ok(Self { client, reach })
    }

    /// Where it sends.
    pub fn reach(&self) -> Reach {
        self.reach
    }

    /// Posts a notice, signed at `seconds` since 1970.
    pub async fn send(&self, row: NoticeRow, seconds: i64) -> Outcome {
        let Some(key) = key(&row.webhook.secret) else { return Outcome::Gone };
        let url = match address(&row.webhook.url, self.reach) {
            Ok(url) => url,
            Err(error) => return Outcome::Failed(error.to_owned()),
        };
        let id = format!("{}-{}", row.job, row.sequence);
        let data = NoticeData { id: row.job, name: row.name, state: row.state, reason: row.reason };
        let notice = Notice { kind: NoticeKind::JobState, timestamp: row.changed_at, data };
        let body = serde_json::to_string(&notice).expect("a notice is plain data");
        let post = self.client.post(url).header("content-type", "application/json");
        let post = post
            .header("webhook-timestamp", seconds)
            .header("webhook-signature", sign(&key, &id, seconds, &body));
        match post.header("webhook-id", id).body(body).send().await {
            Ok(answer) if answer.status().is_success() => Outcome::Taken,
            Ok(answer) if answer.status() == StatusCode::GONE => Outcome::Gone,
            Ok(answer) => Outcome::Failed(format!("it answered {}", answer.status())),
            // Without the address, which may be secret.
            Err(error) => Outcome::Failed(error.without_url().to_string()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_addresses_of_the_public_internet_are_public() {
        for ip in [
            "1.1.1.1",
            "93.184.216.34",
            "172.32.0.1",
            "2606:4700::1111",
            "64:ff9b::101:101",
            "::ffff:8.8.8.8",
        ] {
            assert!(is_public(ip.parse().unwrap()), "{ip}");
        }
        for ip in [
            "127.0.0.1",
            "127.9.9.9",
            "10.0.0.1",
            "172.16.0.1",
            "192.168.1.1",
            "169.254.169.254",
            "100.64.0.1",
            "0.0.0.0",
            "0.1.2.3",
            "224.0.0.1",
            "240.0.0.1",
            "255.255.255.255",
            "192.0.2.1",
            "198.18.0.1",
            "::",
            "::1",
            "fe80::1",
            "fc00::1",
            "fd12::1",
            "ff02::1",
            "::ffff:127.0.0.1",
            "::ffff:10.0.0.1",
            "64:ff9b::7f00:1",
            "2002:7f00:1::",
            "2001:db8::1",
            "2001::1",
            "::7f00:1",
            "fec0::1",
        ] {
            assert!(!is_public(ip.parse().unwrap()), "{ip}");
        }
    }

    #[test]
    fn addresses_and_secrets_are_checked() {
        let secret = Some(format!("whsec_{}", BASE64_STANDARD.encode([7; 24])));
        let of =
            |url: &str, reach| check(&WebhookRequest { url: url.to_owned(), secret: secret.clone() }, reach);
        assert!(of("https://example.com/hook?key=1", Reach::Public).is_ok());
        for url in [
            "",
            "example.com",
            "ftp://example.com/",
            "file:///etc/passwd",
            "http://user@example.com/",
            "http://127.0.0.1/",
            "http://127.1/",
            "http://0x7f000001/",
            "http://2130706433/",
            "http://[::1]/",
            "http://[::ffff:127.0.0.1]/",
            "http://localhost:7700/",
            "http://LOCALHOST/",
            "http://a.localhost/",
            "http://169.254.169.254/latest",
            "http://10.0.0.1/",
            &format!("http://example.com/{}", "x".repeat(URL_MAX)),
        ] {
            let faults = of(url, Reach::Public).unwrap_err();
            assert_eq!((faults.len(), faults[0].pointer.as_str()), (1, "/webhook/url"), "{url}");
        }
        assert!(of("http://127.0.0.1:1/", Reach::Anywhere).is_ok());
        for secret in
            [None, Some("short".to_owned()), Some(format!("whsec_{}", BASE64_STANDARD.encode([7; 23])))]
        {
            let request = WebhookRequest { url: "https://example.com/".to_owned(), secret };
            assert_eq!(check(&request, Reach::Public).unwrap_err()[0].pointer, "/webhook/secret");
        }
    }

    #[test]
    fn what_is_shown_holds_no_secret() {
        let request = WebhookRequest {
            url: "https://a.example:8443/key/123?x=y".to_owned(),
            secret: Some("s".to_owned()),
        };
        let shown = shown(&request);
        assert_eq!((shown.url.as_str(), shown.secret), ("https://a.example:8443", None));
        let webhook = Webhook { url: request.url, secret: "geheim".to_owned() };
        assert!(!format!("{webhook:?}").contains("geheim"));
    }

    /// Against Python's `hmac`.
    #[test]
    fn a_signature_is_that_of_the_standard() {
        let key = key("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let signature = sign(&key, "msg_p5jXN8AQM9LWM0D4loKWxJek", 1_614_265_330, r#"{"test": 2432232314}"#);
        assert_eq!(signature, "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    }

    #[tokio::test]
    async fn names_that_lead_to_this_machine_are_not_followed() {
        let resolved = PublicOnly.resolve("localhost".parse().unwrap()).await;
        assert!(resolved.is_err());
    }
}
