//! Tokens: what the language page says about characters, names, numbers, strings and comments.

use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::lexer::lex;
use bittybuzz_compiler::source::FileId;
use bittybuzz_compiler::token::{Separation, Token, TokenKind, hash_tokens};

use crate::front::support::{expect, expect_tree, expect_value, expect_words, parse_text};

fn tokens(text: &str) -> (Vec<Token>, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let tokens = lex(FileId(0), text, &mut diagnostics);
    (tokens, diagnostics)
}

/// The tokens of a correct text, each as in a message.
fn words(text: &str) -> Vec<String> {
    let (tokens, diagnostics) = tokens(text);
    assert!(diagnostics.is_empty(), "{text}: {diagnostics:?}");
    tokens.iter().map(|token| token.kind.describe()).collect()
}

#[test]
fn names_start_with_a_letter_or_underscore() {
    for name in ["x", "_x", "_", "__", "a1", "aB_9", "iff", "nilx", "Var", "include", "included"] {
        assert_eq!(words(name), [format!("`{name}`"), "the end of the file".to_owned()]);
    }
}

#[test]
fn include_is_a_keyword_only_before_a_string() {
    expect_tree("include = 1 include_path = include", "(= include 1) (= include_path include)");
    expect_tree("t.include = 2", "(= t.include 2)");
    let (tokens, _) = tokens("include 'a.bzz'");
    assert_eq!(tokens[0].kind, TokenKind::Include("a.bzz".to_owned()));
    assert_eq!((tokens[0].span.start, tokens[0].span.end), (0, 15));
}

#[test]
fn integers() {
    expect_value("0", "0");
    expect_value("007", "7");
    expect_value("32768", "32768");
    expect_value("0x1F", "31");
    expect_value("0XfF", "255");
    expect_value("9223372036854775807", "9223372036854775807");
}

#[test]
fn floats() {
    expect_value("5.", "5.0");
    expect_value("5.0", "5.0");
    expect_value(".5", "0.5");
    expect_value("1e3", "1000.0");
    expect_value("1E-3", "0.001");
    expect_value("2.5e+2", "250.0");
    expect_value("5.e1", "50.0");
    expect_value(".5e1", "5.0");
    expect_value("0.0", "0.0");
    expect_value("0e5", "0.0");
}

#[test]
fn an_e_without_digits_begins_a_word() {
    expect_tree("if(a) x = 1else x = 2", "(if a {(= x 1)} {(= x 2)})");
    expect_tree("x = 1e = 2", "(= x 1) (= e 2)");
}

#[test]
fn a_dot_before_a_digit_is_a_fraction_unless_it_belongs_to_a_field() {
    expect_value("{.2 = .5, .2.5 = 3, .3=.4}", "{.2=0.5, .2.5=3, .3=0.4}");
    expect_value("{.0 = 1}", "{.0=1}");
    expect_value(
        "{ .1 = {.2 = .3, .4 = .5}, .6 = f(.7, .8) }",
        "{.1={.2=0.3, .4=0.5}, .6=f(0.7, 0.8)}",
    );
    expect_tree("f(.5, -.5)", "f(0.5, -0.5)");
    expect_value("t[.5] + .5", "(+ t[0.5] 0.5)");
    expect_tree("function f() { return .5 }", "(function f () {(return 0.5)})");
    expect("r = t.5", &["E0218 1:6"]);
    expect("r = f().5", &["E0218 1:8"]);
    expect("r = t[1].5", &["E0218 1:9"]);
    expect_words("r = t.5", &["`[5]`"]);
}

#[test]
fn malformed_numbers() {
    expect("x = 1.2.3", &["E0104 1:5"]);
    expect("x = 1..2", &["E0104 1:5"]);
    expect("x = {.1.2.3 = 4}", &["E0104 1:7"]);
    expect("x = 0b101", &["E0104 1:5"]);
    expect_words("x = 0b101", &["no binary numbers"]);
    // Buzz reads `0.0.` as `0.0`, and published programs have it.
    expect("x = {.y=0.0., .z=1.}", &["W0111 1:9"]);
    expect("x = 2.5.\ny = 3..", &["W0111 1:5", "E0104 2:5"]);
    expect("x = 1.5.e", &["E0104 1:5", "E0214 1:9"]);
    expect("x = 0x", &["E0104 1:5"]);
    expect("x = 0x1G", &["E0104 1:5"]);
    expect("x = 1_000", &["E0104 1:5"]);
    expect("x = 1e3.5", &["E0104 1:5"]);
    expect_words("x = 1.2.3", &["`1.2.3`", "at most one decimal point"]);
}

#[test]
fn numbers_beyond_every_profile() {
    expect("x = 9223372036854775808", &["E0105 1:5"]);
    expect("x = 0x10000000000000000", &["E0105 1:5"]);
    expect("x = 1e400", &["E0105 1:5"]);
    expect("x = 1e-400", &["E0105 1:5"]);
    expect_words("x = 1e-400", &["too small"]);
}

#[test]
fn strings_with_either_quote_and_all_escapes() {
    expect_value(r#""a'b""#, r#""a'b""#);
    expect_value(r#"'a"b'"#, r#""a\"b""#);
    expect_value(r#""\n\t\\\"\'""#, r#""\n\t\\\"'""#);
    expect_value(r#"'\\'"#, r#""\\""#);
    expect_value(r#"'\\\''"#, r#""\\'""#);
    expect_value("\"\"", "\"\"");
    expect_value("\"größe ∞\"", "\"größe ∞\"");
    expect_value("\"# no comment; // no comment\"", "\"# no comment; // no comment\"");
}

#[test]
fn a_newline_may_stand_in_a_string_and_counts_as_a_line() {
    expect_value("\"a\nb\"", "\"a\\nb\"");
    expect_value("\"a\r\nb\"", "\"a\\nb\"");
    expect("x = \"a\nb\"\ny = = 1", &["E0201 3:5"]);
}

#[test]
fn unknown_escapes_are_named_and_recovered_from() {
    expect("x = \"a\\qb\\z\"\ny = 1", &["E0103 1:7", "E0103 1:10"]);
    expect_words("x = '\\r'", &["`\\r`", "`\\n`"]);
}

#[test]
fn an_unterminated_string_is_reported_where_it_opens() {
    expect("x = 1\ny = \"abc", &["E0102 2:5"]);
    expect("x = 'abc\ny = = 1", &["E0102 1:5", "E0201 2:5"]);
    expect("x = 'abc\\'", &["E0102 1:5"]);
    expect("x = 'abc\\", &["E0102 1:5"]);
}

#[test]
fn a_forgotten_quote_is_found_even_if_other_strings_follow() {
    expect("x = \"abc\ny = 2\nlog(\"x\")\nz = = 1", &["E0102 1:5", "E0201 4:5"]);
    let docstring = "function f() \"two\nlines\" { return 1 }\nx = \"abc\nlog(\"y\")";
    expect(docstring, &["E0102 3:5"]);
    // Behind a parenthesis that holds no parameters stands no docstring.
    let value = "x = f(y) \"abc\ny = 2\nlog(\"x\")\nz = = 1";
    expect(value, &["E0102 1:10", "E0214 1:10", "E0201 4:5"]);
}

#[test]
fn comments_go_to_the_end_of_the_line() {
    expect_tree("x = 1 # y = 2\n# z\ny = 3#", "(= x 1) (= y 3)");
}

#[test]
fn blanks_marks_and_line_ends() {
    expect_tree("\u{feff}x\t=\r\n1;;;y=2\r\n", "(= x 1) (= y 2)");
    expect("x = 1\r\n\r\ny = = 2", &["E0201 3:5"]);
}

#[test]
fn tokens_know_what_separates_them() {
    let (tokens, _) = tokens("a b\nc;d #\n; e # ;\nf");
    let separations: Vec<Separation> = tokens.iter().map(|token| token.separation).collect();
    use Separation::{Newline, SameLine, Semicolon};
    assert_eq!(separations, [SameLine, SameLine, Newline, Semicolon, Semicolon, Newline, SameLine]);
}

#[test]
fn columns_count_characters() {
    expect("x = \"äöü\" = 1", &["E0201 1:11"]);
}

#[test]
fn unknown_characters_are_reported_once_per_run() {
    expect("x = @@$ 1 ` y\nz = 1", &["E0101 1:5", "E0101 1:11"]);
    expect("x = größe + naïve", &["E0101 1:5", "E0101 1:13"]);
    expect("x\u{a0}=\u{200b}1", &["E0101 1:2", "E0101 1:4"]);
    expect("x = 1 \u{1}", &["E0101 1:7"]);
    expect_words("x = a ? 1 : 2", &["no `? :`"]);
}

#[test]
fn operators_of_other_languages() {
    let cases = [
        ("if(a && b) x = 1", 6, "`and`"),
        ("if(a || b) x = 1", 6, "`or`"),
        ("if(a =< b) x = 1", 6, "`<=`"),
        ("if(a => b) x = 1", 6, "`>=`"),
        ("if(a ~= b) x = 1", 6, "`!=`"),
        ("if(a <> b) x = 1", 6, "`!=`"),
        ("if(a === b) x = 1", 6, "`==`"),
        ("if(a !== b) x = 1", 6, "`!=`"),
        ("x = a ** b", 7, "`^`"),
        ("x = ~a", 5, "`!`"),
        ("x = a .. b", 7, "string.concat"),
        ("x := 1", 3, "`=`"),
        ("x += 1", 3, "x = x + ..."),
        ("x -= 1", 3, "x = x - ..."),
        ("x *= 1", 3, "x = x * ..."),
        ("x /= 1", 3, "x = x / ..."),
        ("x %= 1", 3, "x = x % ..."),
        ("x ^= 1", 3, "x = x ^ ..."),
        ("x &= 1", 3, "x = x & ..."),
        ("x |= 1", 3, "x = x | ..."),
        ("x <<= 1", 3, "x = x << ..."),
        ("x >>= 1", 3, "x = x >> ..."),
        ("x++", 2, "x = x + 1"),
        ("x--", 2, "x = x - 1"),
        ("++x", 1, "x = x + 1"),
        ("-- comment", 1, "`#`"),
        ("x = y++", 6, "x = x + 1"),
    ];
    for (text, column, help) in cases {
        expect(text, &[&format!("E0106 1:{column}")]);
        expect_words(text, &[help]);
    }
}

#[test]
fn two_plus_signs_may_be_a_sum() {
    expect_value("a ++b", "(+ a (+ b))");
    expect_value("a--b", "(- a (- b))");
    expect_value("1--1", "(- 1 -1)");
    expect_value("a - -1", "(- a -1)");
    expect_value("--2", "(- -2)");
}

#[test]
fn comments_of_other_languages() {
    expect("x = 1 // one\ny = 2", &["E0107 1:7"]);
    expect("/* a\nb */ x = 1\ny = = 2", &["E0107 1:1", "E0201 3:5"]);
    expect("x = 1 /* no end\ny = = 2", &["E0107 1:7", "E0201 2:5"]);
    expect_words("// x", &["`#`"]);
}

#[test]
fn typographic_quotes() {
    expect("log(“hello”)\nlog(‘x’)\nlog(„x“)", &["E0108 1:5", "E0108 2:5", "E0108 3:5"]);
    expect("x = “abc\ny = 1", &["E0108 1:5"]);
}

fn hash(text: &str) -> u32 {
    parse_text(text).token_hash
}

#[test]
fn the_hash_ignores_layout_and_notation_only() {
    let same = [
        "x = 16 y = \"a\" f(1.5)",
        "x=0x10;y='a'# comment\n\nf ( 1.50 )",
        "\u{feff}x\r\n=\r\n16\r\ny = \"a\" f(15e-1)",
    ];
    assert_eq!(hash(same[0]), hash(same[1]));
    assert_eq!(hash(same[0]), hash(same[2]));
    let different = [
        "x = 17 y = \"a\" f(1.5)",
        "z = 16 y = \"a\" f(1.5)",
        "x = 16 y = \"b\" f(1.5)",
        "x = 16 y = a f(1.5)",
        "x = 16 y = \"a\" f(1)",
        "x = 16.0 y = \"a\" f(1.5)",
        "x = 16 y = \"a\" f(1.5) f()",
        "",
    ];
    for text in different {
        assert_ne!(hash(same[0]), hash(text), "{text}");
    }
    assert_ne!(hash("x = ab c()"), hash("x = a bc()"));
}

#[test]
fn the_hash_sees_the_semicolon_that_makes_a_return_bare() {
    assert_eq!(hash("function f() { return\nx() }"), hash("function f() { return x() }"));
    assert_ne!(hash("function f() { return; x() }"), hash("function f() { return x() }"));
}

#[test]
fn the_hash_is_stable() {
    // FNV-1a of the tokens as token.rs lays them out: kind, length, bytes.
    let tokens: [(u8, &[u8]); 3] = [(1, b"x"), (5, b"="), (2, &[5, 0, 0, 0, 0, 0, 0, 0])];
    let mut expected = 0x811c_9dc5_u32;
    for (kind, bytes) in tokens {
        let length = u32::try_from(bytes.len()).unwrap().to_le_bytes();
        for byte in [kind].iter().chain(&length).chain(bytes) {
            expected = (expected ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
        }
    }
    assert_eq!(hash_tokens(&tokens_of("x = 5")), expected);
}

fn tokens_of(text: &str) -> Vec<Token> {
    tokens(text).0
}

/// A comment would go on to the end of the file.
#[test]
fn lines_that_end_with_a_carriage_return_alone_are_refused() {
    expect("# a comment\rx = 1\ry = = 2\r", &["E0101 1:12", "E0201 1:23"]);
    expect("x = 1\ry = 2", &["E0101 1:6"]);
    expect("# a comment\r\nx = 1\r\ny = \"a\"\r\n", &[]);
}
