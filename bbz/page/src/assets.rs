//! The files of the page.

/// A file of the page.
pub struct Asset {
    /// The name in the URL; empty for the page itself.
    pub name: &'static str,
    /// The value of the `Content-Type` header.
    pub media_type: &'static str,
    pub bytes: &'static [u8],
}

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";

macro_rules! asset {
    ($name:literal, $file:literal, $media_type:expr) => {
        Asset {
            name: $name,
            media_type: $media_type,
            bytes: include_bytes!(concat!("../web/", $file)),
        }
    };
    ($file:literal, $media_type:expr) => {
        asset!($file, $file, $media_type)
    };
}

const ASSETS: [Asset; 56] = [
    asset!("", "index.html", HTML),
    asset!("style.css", STYLE),
    asset!("about.js", SCRIPT),
    asset!("bodies.js", SCRIPT),
    asset!("build-hand.js", SCRIPT),
    asset!("build-panel.js", SCRIPT),
    asset!("build-picture.js", SCRIPT),
    asset!("builder.js", SCRIPT),
    asset!("buzz.js", SCRIPT),
    asset!("camera.js", SCRIPT),
    asset!("controls.js", SCRIPT),
    asset!("curve.js", SCRIPT),
    asset!("curves.js", SCRIPT),
    asset!("display.js", SCRIPT),
    asset!("drawing.js", SCRIPT),
    asset!("editor-state.js", SCRIPT),
    asset!("editor.js", SCRIPT),
    asset!("element.js", SCRIPT),
    asset!("fault.js", SCRIPT),
    asset!("fence.js", SCRIPT),
    asset!("focus.js", SCRIPT),
    asset!("glyph.js", SCRIPT),
    asset!("grading.js", SCRIPT),
    asset!("ground.js", SCRIPT),
    asset!("labels.js", SCRIPT),
    asset!("legend.js", SCRIPT),
    asset!("log.js", SCRIPT),
    asset!("main.js", SCRIPT),
    asset!("marks.js", SCRIPT),
    asset!("memory.js", SCRIPT),
    asset!("messages.js", SCRIPT),
    asset!("notice.js", SCRIPT),
    asset!("obstacles.js", SCRIPT),
    asset!("paint.js", SCRIPT),
    asset!("pointer.js", SCRIPT),
    asset!("programs.js", SCRIPT),
    asset!("questions.js", SCRIPT),
    asset!("recording.js", SCRIPT),
    asset!("robot.js", SCRIPT),
    asset!("scale.js", SCRIPT),
    asset!("scene.js", SCRIPT),
    asset!("seed.js", SCRIPT),
    asset!("session.js", SCRIPT),
    asset!("statement.js", SCRIPT),
    asset!("stepper.js", SCRIPT),
    asset!("table.js", SCRIPT),
    asset!("texts-en.js", SCRIPT),
    asset!("texts-fr.js", SCRIPT),
    asset!("texts.js", SCRIPT),
    asset!("things.js", SCRIPT),
    asset!("timeline.js", SCRIPT),
    asset!("trails.js", SCRIPT),
    asset!("trials.js", SCRIPT),
    asset!("unsaved-texts.js", SCRIPT),
    asset!("vendor.js", SCRIPT),
    asset!("view.js", SCRIPT),
];

/// Returns the files of the page.
pub fn all() -> &'static [Asset] {
    &ASSETS
}

/// Returns the file with that name.
pub fn find(name: &str) -> Option<&'static Asset> {
    ASSETS.iter().find(|asset| asset.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn every_file_of_the_folder_is_served() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/web");
        let mut count = 0;
        for entry in fs::read_dir(folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            let served = if name == "index.html" { "" } else { &name };
            assert!(find(served).is_some(), "{name} is not in ASSETS");
            count += 1;
        }
        assert_eq!(count, ASSETS.len());
    }
}
