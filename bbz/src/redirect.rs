//! A file that leads a browser to the page.
//!
//! Every user of a computer can read the command lines of all processes. The browser therefore gets
//! the name of this file, which only the user can read, instead of the page's address and its secret.

use std::env;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile, TempDir};

/// The file. It is removed when this value is dropped, and its folder after it.
pub struct Redirect {
    file: NamedTempFile,
    _folder: TempDir,
}

impl Redirect {
    /// Writes a file that leads to an address.
    pub fn new(url: &str) -> io::Result<Self> {
        let mut builder = Builder::new();
        builder.prefix("bbz-");
        // On Windows, the folder for temporary files belongs to the user, and so does what is in it.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o700));
        let folder = builder.tempdir_in(folder())?;
        // A temporary file has the mode 0600 from its creation on.
        let mut file = Builder::new().suffix(".html").tempfile_in(&folder)?;
        file.write_all(text(url).as_bytes())?;
        Ok(Redirect { file, _folder: folder })
    }

    pub fn path(&self) -> &Path {
        self.file.path()
    }
}

/// Returns the folder of the user's session, which other users cannot open, or else that for
/// temporary files.
fn folder() -> PathBuf {
    let session = env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
    session.filter(|folder| folder.is_absolute() && folder.is_dir()).unwrap_or_else(env::temp_dir)
}

/// Returns a page that opens the address, which has no character with a meaning in HTML.
fn text(url: &str) -> String {
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n\
         <meta name=\"referrer\" content=\"no-referrer\">\n\
         <meta http-equiv=\"refresh\" content=\"0; url={url}\">\n\
         <title>BittyBuzz</title>\n<p><a href=\"{url}\">The page of this run</a></p>\n</html>\n"
    )
}
