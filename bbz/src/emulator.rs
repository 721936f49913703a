//! Which program emulates robots.

use std::env;
use std::path::{Path, PathBuf};

/// The one that is taken if none is named.
const USUAL: &str = "bbz-emulate-stm32";

/// Where the program is: beside this one, or wherever PATH finds it, unless it is named by a path.
pub fn program(named: Option<&Path>) -> PathBuf {
    let usual = || PathBuf::from(format!("{USUAL}{}", env::consts::EXE_SUFFIX));
    let name = named.map_or_else(usual, Path::to_owned);
    let beside = match name.components().count() {
        1 => env::current_exe().ok().map(|this| this.with_file_name(&name)),
        _ => None,
    };
    beside.filter(|path| path.is_file()).unwrap_or(name)
}
