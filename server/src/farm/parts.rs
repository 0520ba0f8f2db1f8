//! Files that are uploaded in parts: each part is durable once it is answered, and a client that was cut off goes on where it
//! was, with whatever server.

use super::{
    Farm,
    error::{FarmError, Result, fault},
    scene::Novelty,
};
use crate::blobs::{BlobFolder, BlobName, Upload};
use bytes::Bytes;
use futures::StreamExt as _;
use ovtigre_proto::{
    id::BlobId,
    scene::{PartsReceived, SceneReport},
};

/// Parts of one file, at most.
const PARTS_MAX: usize = 10_000;

/// Which bytes of a file a part has: from the first on, before the second, of so many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The first.
    pub from: u64,
    /// After the last.
    pub to: u64,
    /// Of the whole file.
    pub whole: u64,
}

/// A part that is being received.
#[derive(Debug)]
pub struct IncomingPart {
    upload: Upload,
    span: Span,
    bytes: u64,
}

/// What there is of a file after a part of it came.
#[derive(Debug)]
pub enum Received {
    /// Not all.
    Some(PartsReceived),
    /// All.
    All(Box<SceneReport>, Novelty),
}

impl IncomingPart {
    /// The next piece.
    pub async fn write(&mut self, piece: Bytes) -> Result<()> {
        self.bytes += piece.len() as u64;
        if self.bytes > self.span.to - self.span.from {
            return Err(length_differs());
        }
        Ok(self.upload.write(piece).await?)
    }

    /// Forgets it.
    pub async fn abort(self) {
        if let Err(error) = self.upload.abort().await {
            tracing::warn!(%error, "a part of an upload was not removed");
        }
    }
}

fn length_differs() -> FarmError {
    FarmError::Request(vec![fault("", "the part has another length than its Content-Range says")])
}

/// Bytes that are there from the first on, and the parts that make them up.
fn reach(parts: &[(u64, u64)]) -> (u64, Vec<(u64, u64)>) {
    let mut reached = 0;
    let mut used = Vec::new();
    for (from, to) in parts.iter().copied() {
        if from <= reached && to > reached {
            used.push((from, to));
            reached = to;
        }
    }
    (reached, used)
}

impl Farm {
    /// How much of a file of `whole` bytes is there, from its first byte on.
    pub async fn received(&self, id: &BlobId, whole: u64) -> Result<PartsReceived> {
        let received = reach(&self.blobs.parts(id).await?).0.min(whole);
        Ok(PartsReceived { received, bytes: whole })
    }

    /// Begins to receive a part.
    pub async fn receive_part(&self, id: &BlobId, span: Span) -> Result<IncomingPart> {
        self.need_room()?;
        let limit = self.rules.scene_bytes;
        if span.whole > limit {
            return Err(FarmError::TooLarge { limit });
        }
        if self.blobs.parts(id).await?.len() >= PARTS_MAX {
            let detail = format!("a file is sent in {PARTS_MAX} parts at most: send larger ones");
            return Err(FarmError::Request(vec![fault("", detail)]));
        }
        let upload = self.blobs.upload(self.ids.text(16)).await?;
        Ok(IncomingPart { upload, span, bytes: 0 })
    }

    /// Keeps a part. Where it was the last that was missing, the file is put together, checked and looked into.
    pub async fn take_part(&self, id: &BlobId, part: IncomingPart) -> Result<Received> {
        let IncomingPart { upload, span, bytes } = part;
        if bytes != span.to - span.from {
            upload.abort().await?;
            return Err(length_differs());
        }
        upload.finish(&BlobName::Part(id.clone(), span.from, span.to)).await?;
        let (reached, parts) = reach(&self.blobs.parts(id).await?);
        if reached < span.whole {
            return Ok(Received::Some(PartsReceived { received: reached, bytes: span.whole }));
        }
        let taken = self.put_together(id, parts).await;
        // Of bytes that are not those of the name, nobody knows which are wrong.
        if matches!(taken, Ok(_) | Err(FarmError::HashMismatch { .. } | FarmError::Scene(_))) {
            self.blobs.delete_all(&BlobFolder::Parts(id.clone())).await?;
        }
        taken.map(|(report, novelty)| Received::All(Box::new(report), novelty))
    }

    async fn put_together(&self, id: &BlobId, parts: Vec<(u64, u64)>) -> Result<(SceneReport, Novelty)> {
        let mut whole = self.receive().await?;
        let mut written = 0;
        for (from, to) in parts {
            let mut pieces = self.blobs.stream(&BlobName::Part(id.clone(), from, to)).await?.1;
            let mut skip = written - from;
            while let Some(piece) = pieces.next().await {
                let piece = match piece {
                    Ok(piece) => piece,
                    Err(error) => {
                        whole.abort().await;
                        return Err(error.into());
                    }
                };
                let skipped = skip.min(piece.len() as u64);
                skip -= skipped;
                whole.write(piece.slice(skipped as usize..)).await?;
            }
            written = to;
        }
        self.take_in(whole, Some(id)).await
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farm::tests::bench::{Bench, rules};

    #[test]
    fn parts_reach_as_far_as_there_is_no_gap() {
        for (parts, reached, used) in [
            (&[][..], 0, 0),
            (&[(0, 5), (5, 9)], 9, 2),
            (&[(0, 5), (6, 9)], 5, 1),
            (&[(0, 5), (2, 4), (3, 9)], 9, 2),
            (&[(1, 5)], 0, 0),
        ] {
            assert_eq!((reach(parts).0, reach(parts).1.len()), (reached, used), "{parts:?}");
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_file_is_put_together_of_parts_in_any_order_also_after_a_crash() {
        let mut bench = Bench::new(rules()).await;
        let bytes = b"a scene that comes in parts";
        let id = BlobId::of(*blake3::hash(bytes).as_bytes());
        let whole = bytes.len() as u64;
        let send = async |bench: &Bench, from: u64, to: u64, bytes: &'static [u8]| {
            let mut part = bench.farm.receive_part(&id, Span { from, to, whole }).await?;
            part.write(Bytes::from_static(&bytes[from as usize..to as usize])).await?;
            bench.farm.take_part(&id, part).await
        };
        send(&bench, 10, whole, bytes).await.unwrap();
        assert_eq!(bench.farm.received(&id, whole).await.unwrap().received, 0);
        send(&bench, 0, 7, bytes).await.unwrap();
        bench = bench.crash().await;
        assert_eq!(bench.farm.received(&id, whole).await.unwrap().received, 7, "it is still there");
        let Received::All(report, Novelty::New) = send(&bench, 5, 12, bytes).await.unwrap() else {
            panic!("all is there")
        };
        assert_eq!((report.id, report.bytes), (id.clone(), whole));
        assert!(bench.farm.blobs.parts(&id).await.unwrap().is_empty(), "parts are not kept");

        let other = b"A scene that comes in parts";
        let wrong = async |from, to| {
            let named = BlobId::of([7; 32]);
            let mut part = bench.farm.receive_part(&named, Span { from, to, whole }).await?;
            part.write(Bytes::from_static(&other[from as usize..to as usize])).await?;
            bench.farm.take_part(&named, part).await
        };
        wrong(0, 20).await.unwrap();
        let refused = wrong(20, whole).await.unwrap_err();
        assert!(matches!(refused, FarmError::HashMismatch { .. }), "{refused}");
        assert_eq!(bench.farm.received(&BlobId::of([7; 32]), whole).await.unwrap().received, 0);
    }
}
