//! One call of `bbz`.

use std::ffi::OsString;

/// A call of `bbz` in a folder of its own.
#[derive(Debug, Clone, Default)]
pub struct Case {
    /// The files of the folder, by path in it.
    pub files: Vec<(OsString, Vec<u8>)>,
    /// The special files of the folder.
    pub special: Vec<(String, Special)>,
    pub arguments: Vec<OsString>,
    pub stdin: Vec<u8>,
    /// The files that the call may make, change or remove. A folder stands for all files in it.
    pub outputs: Vec<OsString>,
    pub streams: Streams,
    /// Arguments of the shell's `ulimit`, in addition to the limits of all calls.
    pub limits: Vec<String>,
    /// Variables of the environment; `None` removes one.
    pub variables: Vec<(String, Option<OsString>)>,
}

/// A file that is no regular one.
#[derive(Debug, Clone)]
pub enum Special {
    Folder,
    Pipe,
    Socket,
    /// A link to that path.
    Link(String),
}

/// The streams of a call.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Streams {
    /// All streams are pipes.
    #[default]
    Piped,
    /// Streams as a redirection of the shell makes them.
    Redirected(&'static str),
}

impl Case {
    /// Returns a call with these arguments.
    pub fn new<A: Into<OsString>>(arguments: impl IntoIterator<Item = A>) -> Self {
        let arguments = arguments.into_iter().map(Into::into).collect();
        Case { arguments, ..Case::default() }
    }

    /// Adds a file.
    pub fn with(mut self, name: impl Into<OsString>, content: impl Into<Vec<u8>>) -> Self {
        self.files.push((name.into(), content.into()));
        self
    }

    /// Adds a special file.
    pub fn with_special(mut self, name: &str, special: Special) -> Self {
        self.special.push((name.to_owned(), special));
        self
    }

    /// Names an output.
    pub fn writing(mut self, name: impl Into<OsString>) -> Self {
        self.outputs.push(name.into());
        self
    }
}
