//! Why a scene cannot be read, and what is odd about one that can.

/// Why a scene cannot be read: what is wrong, where, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file around the document is broken, or not one.
    #[error("{file}: {detail}")]
    Container {
        /// Name of the file.
        file: String,
        /// What is wrong and what to do.
        detail: String,
    },
    /// The document is not JSON.
    #[error("{file}:{line}:{column}: not valid JSON: {detail}")]
    Json {
        /// Name of the file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the parser says.
        detail: String,
    },
    /// The document contradicts glTF or itself.
    #[error("{file}: {pointer}: {detail}")]
    Document {
        /// Name of the file.
        file: String,
        /// JSON pointer.
        pointer: String,
        /// What is wrong and what to do.
        detail: String,
    },
    /// The document needs an extension that is not supported.
    #[error(
        "{file}: {pointer}: the scene requires the extension {name}, which is not supported; export it without"
    )]
    RequiredExtension {
        /// Name of the file.
        file: String,
        /// JSON pointer.
        pointer: String,
        /// The extension.
        name: String,
    },
    /// A file that the document needs is not in the bundle.
    #[error("{file}: {pointer}: the file \"{uri}\" is missing; put it beside the scene")]
    MissingFile {
        /// Name of the file that refers to it.
        file: String,
        /// JSON pointer.
        pointer: String,
        /// What is missing, relative to the scene's folder.
        uri: String,
    },
    /// A URI does not name a file of the scene's folder.
    #[error("{file}: {pointer}: the URI \"{uri}\" is refused: {detail}")]
    Uri {
        /// Name of the file that holds it.
        file: String,
        /// JSON pointer.
        pointer: String,
        /// The URI, shortened.
        uri: String,
        /// Why.
        detail: String,
    },
    /// A picture cannot be decoded.
    #[error("{file}: {pointer}: {detail}")]
    Picture {
        /// The file that holds the picture.
        file: String,
        /// JSON pointer.
        pointer: String,
        /// What is wrong and what to do.
        detail: String,
    },
    /// There is more of something than is allowed.
    #[error("{file}: {pointer}: {found} {what} are more than the limit of {limit}")]
    Limit {
        /// Name of the file.
        file: String,
        /// JSON pointer; empty for the whole document.
        pointer: String,
        /// Of what.
        what: &'static str,
        /// How much there is.
        found: u64,
        /// How much is allowed.
        limit: u64,
    },
}

impl LoadError {
    /// JSON pointer of the culprit in the document, where there is one.
    pub fn pointer(&self) -> Option<&str> {
        match self {
            Self::Container { .. } | Self::Json { .. } => None,
            Self::Document { pointer, .. }
            | Self::RequiredExtension { pointer, .. }
            | Self::MissingFile { pointer, .. }
            | Self::Uri { pointer, .. }
            | Self::Picture { pointer, .. }
            | Self::Limit { pointer, .. } => Some(pointer),
        }
    }
}

/// Something odd about a scene that can be read all the same.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// JSON pointer; empty for the whole document.
    pub pointer: String,
    /// What is odd, and what became of it.
    pub detail: String,
}

/// Problems in the order they were found, without repetitions, and not without end.
#[derive(Debug, Default)]
pub(crate) struct Problems {
    list: Vec<Problem>,
    left_out: usize,
}

/// Problems listed in full; of the rest only the number is told.
const LISTED: usize = 100;

impl Problems {
    pub(crate) fn add(&mut self, pointer: impl Into<String>, detail: impl Into<String>) {
        let problem = Problem { pointer: pointer.into(), detail: detail.into() };
        if self.list.contains(&problem) {
            return;
        }
        if self.list.len() < LISTED {
            self.list.push(problem);
        } else {
            self.left_out += 1;
        }
    }

    /// An error about a part of the document that the scene does not use.
    pub(crate) fn add_error(&mut self, error: &LoadError) {
        let pointer = error.pointer().unwrap_or_default();
        let text = error.to_string();
        let place = format!("{pointer}: ");
        let detail = text.find(&place).map_or(text.as_str(), |at| &text[at + place.len()..]);
        self.add(pointer, format!("{detail} (not used by the scene)"));
    }

    pub(crate) fn finish(mut self) -> Vec<Problem> {
        if self.left_out > 0 {
            let detail = format!("{} further problems are not listed", self.left_out);
            self.list.push(Problem { pointer: String::new(), detail });
        }
        self.list
    }
}
