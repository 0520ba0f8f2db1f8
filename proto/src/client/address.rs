//! Where a farm is.

use super::error::ClientError;
use reqwest::Url;
use std::net::IpAddr;

/// A farm's address: `http://host:port`, perhaps with a path that everything is under.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address(Url);

impl Address {
    /// From what a user wrote; `http://` may be left out.
    pub fn parse(text: &str) -> Result<Self, ClientError> {
        let wrong = |reason: &str| ClientError::Address { text: text.to_owned(), reason: reason.to_owned() };
        let whole = if text.contains("://") { text.to_owned() } else { format!("http://{text}") };
        let mut url = Url::parse(&whole).map_err(|e| wrong(&e.to_string()))?;
        match url.scheme() {
            "http" | "https" => {}
            _ => return Err(wrong("write http://HOST:PORT or https://HOST:PORT")),
        }
        if url.host_str().is_none_or(str::is_empty) {
            return Err(wrong("write http://HOST:PORT or https://HOST:PORT"));
        }
        url.set_query(None);
        url.set_fragment(None);
        let path = url.path().trim_end_matches('/').to_owned();
        url.set_path(&path);
        Ok(Self(url))
    }

    /// The address of `route`, which begins with a slash.
    pub fn join(&self, route: &str) -> Url {
        let mut url = self.0.clone();
        url.set_path(&format!("{}{route}", self.0.path().trim_end_matches('/')));
        url
    }

    /// Which machine, and where on it.
    pub fn host_and_port(&self) -> (String, u16) {
        let host = self.0.host_str().unwrap_or_default();
        let bare = host.trim_start_matches('[').trim_end_matches(']').to_owned();
        (bare, self.0.port_or_known_default().unwrap_or(80))
    }

    /// Whether it is on this machine.
    pub fn is_loopback(&self) -> bool {
        let host = self.0.host_str().unwrap_or_default();
        let bare = host.trim_start_matches('[').trim_end_matches(']');
        host == "localhost" || bare.parse::<IpAddr>().is_ok_and(|ip| ip.is_loopback())
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0.as_str().trim_end_matches('/'))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_users_write_is_understood() {
        for (text, shown, joined) in [
            ("127.0.0.1:7700", "http://127.0.0.1:7700", "http://127.0.0.1:7700/v1/jobs"),
            ("http://farm/", "http://farm", "http://farm/v1/jobs"),
            ("http://farm:80/under/it/", "http://farm/under/it", "http://farm/under/it/v1/jobs"),
            ("https://farm", "https://farm", "https://farm/v1/jobs"),
            ("localhost:1?x#y", "http://localhost:1", "http://localhost:1/v1/jobs"),
        ] {
            let address = Address::parse(text).unwrap();
            assert_eq!((address.to_string().as_str(), address.join("/v1/jobs").as_str()), (shown, joined));
        }
        assert!(Address::parse("[::1]:7700").unwrap().is_loopback());
        assert!(!Address::parse("farm:7700").unwrap().is_loopback());
        for text in ["", "http://", "ftp://farm", "http://a b"] {
            assert!(Address::parse(text).is_err(), "{text}");
        }
    }
}
