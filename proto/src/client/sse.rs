//! Server-sent events, from bytes: the event stream format of the HTML standard.

use std::collections::VecDeque;

/// Longest event that is read.
const EVENT_MAX: usize = 8 << 20;

/// One event.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The last id seen, this event's included.
    pub id: Option<String>,
    /// Its data, lines joined.
    pub data: String,
}

/// An event longer than is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("an event is longer than {EVENT_MAX} bytes")]
pub struct TooLong;

/// Takes bytes as they come and gives whole events.
#[derive(Debug, Default)]
pub struct Parser {
    line: Vec<u8>,
    after_return: bool,
    data: Option<String>,
    id: Option<String>,
    ready: VecDeque<Message>,
}

impl Parser {
    /// Takes the next bytes.
    pub fn push(&mut self, bytes: &[u8]) -> Result<(), TooLong> {
        for &byte in bytes {
            let was_return = std::mem::replace(&mut self.after_return, byte == b'\r');
            match byte {
                b'\n' if was_return => {}
                b'\n' | b'\r' => self.end_line(),
                _ => self.line.push(byte),
            }
            if self.line.len() + self.data.as_ref().map_or(0, String::len) > EVENT_MAX {
                return Err(TooLong);
            }
        }
        Ok(())
    }

    /// The next whole event.
    pub fn pop(&mut self) -> Option<Message> {
        self.ready.pop_front()
    }

    fn end_line(&mut self) {
        let line = String::from_utf8_lossy(&self.line).into_owned();
        self.line.clear();
        if line.is_empty() {
            if let Some(data) = self.data.take() {
                self.ready.push_back(Message { id: self.id.clone(), data });
            }
            return;
        }
        let (field, value) = line.split_once(':').unwrap_or((&line, ""));
        let value = value.strip_prefix(' ').unwrap_or(value);
        match field {
            "data" => {
                if let Some(data) = &mut self.data {
                    data.push('\n');
                    data.push_str(value);
                } else {
                    self.data = Some(value.to_owned());
                }
            }
            "id" if !value.contains('\0') => self.id = Some(value.to_owned()),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, piece: usize) -> Vec<Message> {
        let mut parser = Parser::default();
        for bytes in text.as_bytes().chunks(piece) {
            parser.push(bytes).unwrap();
        }
        std::iter::from_fn(|| parser.pop()).collect()
    }

    #[test]
    fn events_are_the_same_however_the_bytes_are_cut_and_lines_end() {
        let text = ": hello\n\nid: 7\nevent: x\ndata: {\"a\":\ndata:1}\n\nretry: 5\n\ndata\n\ndata: cut off";
        let message = |data: &str| Message { id: Some("7".to_owned()), data: data.to_owned() };
        let expected = vec![message("{\"a\":\n1}"), message("")];
        for ending in ["\n", "\r\n", "\r"] {
            for piece in [1, 2, 3, 1000] {
                assert_eq!(read(&text.replace('\n', ending), piece), expected, "{ending:?} {piece}");
            }
        }
    }

    #[test]
    fn an_endless_event_is_refused() {
        let mut parser = Parser::default();
        let line = format!("data: {}\n", "x".repeat(1 << 20));
        assert!((0..9).any(|_| parser.push(line.as_bytes()).is_err()));
    }
}
