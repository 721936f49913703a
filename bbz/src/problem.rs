//! What is wrong with a command line, or with the files that it names.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use bittybuzz_compiler::bo::error::BoError;
use bittybuzz_robots::{Place, Profile, RobotError};
use bittybuzz_vm_core::ImageError;

use crate::refusal;

/// Why a command cannot be carried out, one variant for each cause.
#[derive(Debug)]
pub enum Problem {
    /// The file cannot be read.
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// A folder where a file is needed.
    Folder(PathBuf),
    /// An extension that says nothing.
    UnknownKind(PathBuf),
    /// An image where a script is needed.
    NotAScript(PathBuf),
    /// An object file that is damaged, or that no Buzz compiler has made.
    Object {
        /// The file.
        path: PathBuf,
        /// Why.
        error: BoError,
    },
    /// `--robot` names no robot, or the robot file is wrong.
    Robot(RobotError),
    /// `--profile` asks for another profile than the image has.
    Profile {
        /// The image.
        path: PathBuf,
        /// Its profile.
        image: Profile,
    },
    /// The virtual machine refuses the image.
    Refused {
        /// Where the image comes from.
        path: PathBuf,
        /// Why.
        cause: ImageError,
    },
    /// A file cannot be written.
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        error: io::Error,
    },
    /// `bbz explain` was asked for a code that does not exist.
    UnknownCode {
        /// The code.
        code: String,
        /// The code that was probably meant.
        likely: Option<String>,
    },
    /// Ctrl-C cannot be taken over.
    Interrupt(ctrlc::Error),
    /// Standard output cannot be written.
    Output(io::Error),
}

impl Problem {
    /// A file that cannot be read.
    pub fn unreadable(path: &Path, error: io::Error) -> Problem {
        Problem::Unreadable { path: path.to_owned(), error }
    }

    /// A file that cannot be written.
    pub fn unwritable(path: &Path, error: io::Error) -> Problem {
        Problem::Unwritable { path: path.to_owned(), error }
    }

    /// An image that the virtual machine refuses.
    pub fn refused(path: &Path, cause: ImageError) -> Problem {
        Problem::Refused { path: path.to_owned(), cause }
    }

    /// Where it is, if it is in a robot file.
    pub fn place(&self) -> Option<&Place> {
        match self {
            Problem::Robot(error) => error.place.as_deref(),
            _ => None,
        }
    }

    /// What to do about it.
    pub fn help(&self) -> Option<String> {
        match self {
            Problem::Unreadable { path, error } if error.kind() == io::ErrorKind::NotFound => {
                likely_file(path).map(|likely| format!("did you mean `{}`?", likely.display()))
            }
            Problem::Folder(_) => Some("name a file in it".to_owned()),
            Problem::UnknownKind(_) => Some(
                "a script ends in .bzz, a Buzz object file in .bo, an image in .bbi".to_owned(),
            ),
            Problem::NotAScript(_) => {
                Some("name the .bzz script that it was built from".to_owned())
            }
            Problem::Profile { image, .. } => Some(format!(
                "leave out --profile, or build the script again with --profile {}",
                match image {
                    Profile::Tiny => Profile::Full.name(),
                    Profile::Full => Profile::Tiny.name(),
                }
            )),
            Problem::Refused { cause, .. } => refusal::help(cause),
            Problem::UnknownCode { likely, .. } => Some(match likely {
                Some(likely) => format!("did you mean {likely}? `bbz explain` lists all codes"),
                None => "`bbz explain` lists all codes".to_owned(),
            }),
            Problem::Robot(error) => error.cause.help(),
            Problem::Object { .. } => Some("compile its script instead".to_owned()),
            Problem::Unreadable { .. }
            | Problem::Unwritable { .. }
            | Problem::Interrupt(_)
            | Problem::Output(_) => None,
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Problem::Unreadable { path, error } => match error.kind() {
                io::ErrorKind::NotFound => write!(f, "there is no file `{}`", path.display()),
                io::ErrorKind::PermissionDenied => {
                    write!(f, "no permission to read `{}`", path.display())
                }
                _ => write!(f, "cannot read `{}`: {error}", path.display()),
            },
            Problem::Folder(path) => write!(f, "`{}` is a folder, not a file", path.display()),
            Problem::UnknownKind(path) => {
                write!(f, "the name `{}` does not tell what the file holds", path.display())
            }
            Problem::NotAScript(path) => {
                write!(f, "`{}` is an image already", path.display())
            }
            Problem::Object { path, error } => {
                write!(f, "`{}` cannot be used: {error}", path.display())
            }
            Problem::Robot(error) => error.cause.fmt(f),
            Problem::Profile { path, image } => write!(
                f,
                "`{}` was built for the {} profile, which --profile cannot change",
                path.display(),
                image.name()
            ),
            Problem::Refused { path, cause } => {
                write!(f, "`{}` {}", path.display(), refusal::sentence(cause))
            }
            Problem::Unwritable { path, error } => {
                write!(f, "cannot write `{}`: {error}", path.display())
            }
            Problem::UnknownCode { code, .. } => write!(f, "there is no code `{code}`"),
            Problem::Interrupt(error) => write!(f, "cannot take over Ctrl-C: {error}"),
            Problem::Output(error) => write!(f, "cannot write to standard output: {error}"),
        }
    }
}

impl std::error::Error for Problem {}

/// The file beside a missing one whose name is most like its.
fn likely_file(path: &Path) -> Option<PathBuf> {
    let wanted = path.file_name()?.to_str()?;
    let folder = path.parent()?;
    let searched = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let names = searched.read_dir().ok()?.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        ([".bzz", ".bo", ".bbi"].iter().any(|end| name.ends_with(end))).then_some(name)
    });
    let scored = names.map(|name| (strsim::jaro_winkler(wanted, &name), name));
    let best = scored.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (best.0 > 0.85).then(|| folder.join(best.1))
}
