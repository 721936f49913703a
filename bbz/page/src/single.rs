//! The page as one text, for a frame without an address, such as the output of a notebook.
//!
//! Scripts become data of an import map, since a page without an address can load no others.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::assets::{self, Asset};

/// The page's connection to a session in another window, instead of one to a server.
const SESSION: &[u8] = include_bytes!("../frame/session.js");

/// The element of the page that loads the style.
const STYLE: &str = r#"<link rel="stylesheet" href="style.css">"#;

/// The element of the page that starts it.
const START: &str = r#"<script type="module" src="main.js"></script>"#;

/// Returns the page for a frame. It exchanges messages with the window around the frame, which passes
/// them to a [`Frames`](crate::Frames) and back (bbz/page/frame/session.js).
pub fn single_page() -> String {
    let scripts = assets::all().iter().filter(|asset| asset.name.ends_with(".js"));
    let imports: Vec<String> = scripts.map(import).collect();
    let style = format!("<style>\n{}</style>", text("style.css"));
    let start = format!(
        "<script type=\"importmap\">{{\"imports\":{{{}}}}}</script>\n\
         <script type=\"module\">import \"page/main.js\";</script>",
        imports.join(",")
    );
    put(&put(text(""), STYLE, &style), START, &start)
}

/// Returns the entry of a script in the import map.
fn import(script: &Asset) -> String {
    let bytes = if script.name == "session.js" { SESSION } else { script.bytes };
    // An address of data has no folder, so modules name each other by the map.
    let named = utf8(bytes).replace("from \"./", "from \"page/");
    let data = STANDARD.encode(named);
    format!("\"page/{}\":\"data:text/javascript;charset=utf-8;base64,{data}\"", script.name)
}

/// Returns a file of the page.
fn text(name: &str) -> &'static str {
    utf8(assets::find(name).expect("the page has this file").bytes)
}

fn utf8(bytes: &'static [u8]) -> &'static str {
    str::from_utf8(bytes).expect("the files of the page are UTF-8")
}

/// Puts a text in the place of an element of the page.
fn put(page: &str, element: &str, text: &str) -> String {
    let (before, after) = page.split_once(element).expect("a test holds that the page has it");
    [before, text, after].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_page_loads_no_other_file() {
        let page = single_page();
        assert!(!page.contains("href=\"style.css\"") && !page.contains("src="), "{}", &page[..400]);
        for script in assets::all().iter().filter(|asset| asset.name.ends_with(".js")) {
            let name = format!("\"page/{}\":\"data:", script.name);
            assert_eq!(page.matches(&name).count(), 1, "{}", script.name);
            assert!(!utf8(script.bytes).contains("import(\"./"), "{}", script.name);
        }
    }
}
