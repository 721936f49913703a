//! Counts the steps of the lexer, the parser and the renderer, for the test that long input takes
//! linear time. Outside of the unit tests, counting does nothing.

#[cfg(test)]
thread_local! {
    static TAKEN: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// Counts a look at that number of bytes or tokens.
#[inline]
pub fn take(count: usize) {
    #[cfg(test)]
    TAKEN.set(TAKEN.get() + count);
    #[cfg(not(test))]
    let _ = count;
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::TAKEN;
    use crate::include::{IncludeLoader, MemoryFiles};
    use crate::parser::parse;
    use crate::render::{ColorChoice, Renderer};

    /// Returns the steps for parsing a text and for rendering its first diagnostics.
    fn steps(text: String) -> usize {
        TAKEN.set(0);
        let files = MemoryFiles::default();
        let parsed = parse(Path::new("main.bzz"), text, &IncludeLoader::new(&files));
        assert!(!parsed.diagnostics.is_empty());
        let renderer = Renderer::new(&parsed.sources);
        for diagnostic in parsed.diagnostics.iter().take(100) {
            renderer.text(diagnostic, ColorChoice::Never);
        }
        TAKEN.get()
    }

    /// Checks that a text of twice the length takes at most twice the steps, and a tenth more. If
    /// the steps grew with the square of the length, they would be four times as many.
    fn check_growth(name: &str, text: impl Fn(usize) -> String) {
        let [short, long] = [20_000, 40_000].map(|bytes| steps(text(bytes)));
        assert!(short >= 20_000, "{name:?}: only {short} steps");
        assert!(long <= 2 * short + short / 10, "{name:?}: {short} and {long} steps");
    }

    #[test]
    fn long_input_takes_linear_time() {
        for piece in [
            "@\n",
            "\"\n",
            "\"\n\\\"\n",
            "/*\n",
            "f(\n",
            "}\n",
            "x\n",
            "return\na.b(1).c = 1 }\n",
            "x = (1\n",
            "(",
            "else ",
            "x y ",
            "x = a\n(b)\n",
            "function f() {\n",
            "t = {.a = 1 .b = 2}\n",
            "if(a b) {}\n",
        ] {
            check_growth(piece, |bytes| piece.repeat(bytes / piece.len()));
        }
    }

    #[test]
    fn unpaired_brackets_take_linear_time() {
        for [opening, closing] in ["(}", "[}", "{)", "(]"].map(|pair| [&pair[..1], &pair[1..]]) {
            let name = format!("{opening}{closing}");
            check_growth(&name, |bytes| opening.repeat(bytes / 2) + &closing.repeat(bytes / 2));
        }
    }
}
