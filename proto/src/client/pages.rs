//! Lists, page by page.

use super::{call::Call, error::ClientError, farm::Client};
use crate::status::Page;
use serde::de::DeserializeOwned;
use std::marker::PhantomData;

/// A list that is fetched as it is read.
#[derive(Debug)]
pub struct Pages<T> {
    client: Client,
    call: Call,
    next: Next,
    items: PhantomData<T>,
}

#[derive(Debug)]
enum Next {
    First,
    Cursor(String),
    End,
}

impl<T: DeserializeOwned> Pages<T> {
    pub(super) fn new(client: Client, call: Call) -> Self {
        Self { client, call, next: Next::First, items: PhantomData }
    }

    /// The next page; `None` at the end.
    pub async fn next(&mut self) -> Result<Option<Vec<T>>, ClientError> {
        let call = match &self.next {
            Next::First => self.call.clone(),
            Next::Cursor(cursor) => self.call.clone().query("cursor", cursor),
            Next::End => return Ok(None),
        };
        let page: Page<T> = self.client.send(&call).await?.json().await?;
        self.next = page.next.map_or(Next::End, Next::Cursor);
        Ok(Some(page.items))
    }

    /// All items, at most `limit`.
    pub async fn all(mut self, limit: usize) -> Result<Vec<T>, ClientError> {
        let mut items = Vec::new();
        while items.len() < limit
            && let Some(page) = self.next().await?
        {
            items.extend(page);
        }
        items.truncate(limit);
        Ok(items)
    }
}
