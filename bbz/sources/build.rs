//! Passes the hash of the sources to the compiler.

#[path = "src/tree.rs"]
mod tree;

use std::env;
use std::error::Error;
use std::path::Path;

use tree::Tree;

fn main() -> Result<(), Box<dyn Error>> {
    let own = env::var("CARGO_MANIFEST_DIR")?;
    let root = Path::new(&own).ancestors().nth(2).ok_or("the crate is not in the repository")?;
    let tree = Tree::read(root)?;
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=src/tree.rs");
    for path in tree.watched()? {
        println!("cargo::rerun-if-changed={}", root.join(path).display());
    }
    println!("cargo::rustc-env=BITTYBUZZ_SOURCES={}", tree.hash()?);
    Ok(())
}
