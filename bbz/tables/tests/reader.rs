//! Tables are read as they were written, and damaged files are errors. Files of other programs are read in
//! python/tests.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::fs::File;
use std::io::Write;
use std::panic::catch_unwind;
use std::slice::from_ref;

use bittybuzz_tables::{
    Block, Cells, Column, Form, Kind, Schema, TableReadError, TableReader, TableWriter, Values,
    Wanted,
};
use parquet::data_type::{BoolType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use proptest::prelude::*;

/// Integers, optional integers, optional numbers, optional texts.
type Row = (i32, Option<i32>, Option<f64>, Option<String>);

const NAMES: [&str; 4] = ["tick", "x_tenths_mm", "global.share", "state"];

fn written(form: Form, blocks: &[Vec<Row>]) -> Vec<u8> {
    let kinds = [Kind::Integer, Kind::OptionalInteger, Kind::OptionalNumber, Kind::OptionalText];
    let columns = NAMES.iter().zip(kinds).map(|(name, kind)| Column::new(*name, kind));
    let schema = Schema::new(columns.collect()).unwrap();
    let mut writer = TableWriter::new(Vec::new(), form, &schema).unwrap();
    for rows in blocks {
        let cells = vec![
            Cells::Integers(rows.iter().map(|row| row.0).collect()),
            Cells::OptionalIntegers(rows.iter().map(|row| row.1).collect()),
            Cells::OptionalNumbers(rows.iter().map(|row| row.2).collect()),
            Cells::OptionalTexts(rows.iter().map(|row| row.3.clone()).collect()),
        ];
        writer.write(&Block::new(&schema, cells).unwrap()).unwrap();
    }
    writer.finish().unwrap()
}

/// Returns a file with these bytes, to be read from its beginning.
fn file(bytes: &[u8]) -> File {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(bytes).unwrap();
    file.reopen().unwrap()
}

/// Reads columns as numbers or texts, all pieces together.
fn read(
    bytes: &[u8],
    form: Form,
    wanted: &[(usize, Wanted)],
) -> Result<Vec<Values>, TableReadError> {
    let mut all: Vec<Values> = Vec::new();
    let mut pieces = TableReader::open(file(bytes), form)?.select(wanted.to_vec());
    while let Some(piece) = pieces.next_piece()? {
        if all.is_empty() {
            all = piece.to_vec();
            continue;
        }
        for (all, piece) in all.iter_mut().zip(piece) {
            match (all, piece) {
                (Values::Numbers(all), Values::Numbers(piece)) => all.extend(piece),
                (Values::Texts(all), Values::Texts(piece)) => all.extend(piece.iter().cloned()),
                _ => unreachable!("a column keeps its kind"),
            }
        }
    }
    Ok(all)
}

fn row() -> impl Strategy<Value = Row> {
    let number = prop_oneof![any::<f64>(), Just(0.1), Just(-0.0), Just(1e300)];
    let number = number.prop_filter("NaN is a missing value", |number| !number.is_nan());
    // A reader of CSV can not tell an empty text from a missing one.
    let text = "[^\u{0}]{1,8}";
    (any::<i32>(), any::<Option<i32>>(), proptest::option::of(number), proptest::option::of(text))
}

proptest! {
    #[test]
    fn files_give_back_all_rows(
        blocks in proptest::collection::vec(proptest::collection::vec(row(), 0..40), 0..4),
    ) {
        let rows = blocks.concat();
        for form in [Form::Parquet, Form::Csv] {
            let bytes = written(form, &blocks);
            let reader = TableReader::open(file(&bytes), form).unwrap();
            prop_assert_eq!(reader.columns(), NAMES);
            // In another order, and one column twice.
            let wanted = [(3, Wanted::Texts), (1, Wanted::Numbers), (2, Wanted::Numbers),
                (0, Wanted::Numbers), (1, Wanted::Texts)];
            let found = read(&bytes, form, &wanted).unwrap();
            if rows.is_empty() {
                prop_assert_eq!(found, []);
                continue;
            }
            let [Values::Texts(texts), Values::Numbers(x), Values::Numbers(shares),
                Values::Numbers(ticks), Values::Texts(digits)] = &found[..] else { panic!() };
            let expected: Vec<_> = rows.iter().map(|row| row.3.clone()).collect();
            prop_assert_eq!(texts, &expected);
            let number = |number: f64| (!number.is_nan()).then_some(number);
            let expected: Vec<_> = rows.iter().map(|row| row.1.map(f64::from)).collect();
            prop_assert_eq!(x.iter().copied().map(number).collect::<Vec<_>>(), expected);
            let bits = |number: f64| number.to_bits();
            let expected: Vec<_> = rows.iter().map(|row| row.2.map(bits)).collect();
            let found: Vec<_> = shares.iter().copied().map(|one| number(one).map(bits)).collect();
            prop_assert_eq!(found, expected);
            let expected: Vec<_> = rows.iter().map(|row| f64::from(row.0)).collect();
            prop_assert_eq!(ticks, &expected);
            let expected: Vec<_> = rows.iter().map(|row| row.1.map(|x| x.to_string())).collect();
            prop_assert_eq!(digits, &expected);
        }
    }
}

fn usual_rows() -> Vec<Row> {
    let row = |n: i32| (n, (n % 3 > 0).then_some(n * n), Some(f64::from(n) / 3.0), None);
    (0..50).map(row).collect()
}

#[test]
fn many_rows_come_in_pieces() {
    let rows: Vec<Row> = (0..50_000).map(|n| (n, None, None, None)).collect();
    for form in [Form::Parquet, Form::Csv] {
        let reader = TableReader::open(file(&written(form, from_ref(&rows))), form).unwrap();
        let mut rest = reader.select(vec![(0, Wanted::Numbers)]);
        let mut pieces = Vec::new();
        while let Some(piece) = rest.next_piece().unwrap() {
            let [Values::Numbers(ticks)] = piece else { panic!("{piece:?}") };
            pieces.push(ticks.clone());
        }
        assert!(pieces.iter().all(|piece| piece.len() < 20_000));
        assert!(pieces.concat().into_iter().eq((0..50_000).map(f64::from)), "{form:?}");
    }
}

#[test]
fn texts_are_no_numbers() {
    let rows = vec![(0, None, None, Some("12.5".to_owned())), (1, None, None, None)];
    let text = |text: &str| vec![(0, None, None, Some(text.to_owned()))];
    for form in [Form::Parquet, Form::Csv] {
        let found = read(&written(form, from_ref(&rows)), form, &[(3, Wanted::Numbers)]).unwrap();
        let [Values::Numbers(found)] = &found[..] else { panic!("{found:?}") };
        assert!(found[0] == 12.5 && found[1].is_nan() && found.len() == 2);
        let error = read(&written(form, &[text("running")]), form, &[(3, Wanted::Numbers)]);
        assert_eq!(error.unwrap_err().to_string(), "column `state` has the text `running`");
        let long = written(form, &[text(&"a".repeat(5000))]);
        let error = read(&long, form, &[(3, Wanted::Texts)]).unwrap_err();
        assert!(error.to_string().contains("has a text of 5000 bytes"), "{error}");
    }
}

/// Each length gives rows or an error, and so does each changed byte, at some of which the library for Parquet
/// panics.
#[test]
fn damaged_files_are_errors() {
    for form in [Form::Parquet, Form::Csv] {
        let whole = written(form, &[usual_rows(), usual_rows()]);
        let all =
            [(0, Wanted::Numbers), (1, Wanted::Numbers), (2, Wanted::Texts), (3, Wanted::Texts)];
        assert!(read(&whole, form, &all).is_ok());
        for length in 0..whole.len() {
            let cut = whole[..length].to_vec();
            let result = catch_unwind(|| read(&cut, form, &all).map(|_| ()));
            let is_line_end = form == Form::Csv && cut.ends_with(b"\n");
            assert!(result.is_ok_and(|result| result.is_err() != is_line_end), "{form:?} {length}");
        }
        for (place, change) in (0..whole.len()).flat_map(|n| [(n, 1 << (n % 8)), (n, 0xff)]) {
            let mut damaged = whole.clone();
            damaged[place] ^= change;
            let result = catch_unwind(|| read(&damaged, form, &all).map(|_| ()));
            assert!(result.is_ok() || form == Form::Parquet, "{form:?}: byte {place}");
        }
    }
}

#[test]
fn messages_about_csv_have_the_line() {
    let error = |text: &str| {
        let numbers = [(0, Wanted::Numbers)];
        read(text.as_bytes(), Form::Csv, &numbers).unwrap_err().to_string()
    };
    assert_eq!(error(""), "it has no line of names");
    assert_eq!(error("a,b\n1,2\n3\n4,5\n"), "line 3 has 1 cells, and the line of names 2");
    assert_eq!(error("a,b\n1,2\n3"), "it ends in the middle of a line");
    assert_eq!(error("a,b\n1,2\n3,4"), "it ends in the middle of a line");
    assert_eq!(error("a,b"), "it ends in the middle of a line");
    let not_text = read(b"a,b\n1,2\n\xff,4\n", Form::Csv, &[(0, Wanted::Numbers)]);
    assert_eq!(not_text.unwrap_err().to_string(), "line 3 is not a text in UTF-8");
}

/// The types that pandas and polars choose: 64-bit integers, floats, truth values, dictionaries.
#[test]
fn types_of_other_programs_are_numbers() {
    let schema = parse_message_type(
        "message row { REQUIRED INT64 run; REQUIRED FLOAT share; REQUIRED BOOLEAN held;
         REQUIRED INT64 big (INTEGER(64, false)); REQUIRED INT64 at (TIMESTAMP(MILLIS, true));
         REPEATED INT64 list; }",
    );
    let properties = WriterProperties::builder().set_dictionary_enabled(true).build();
    let mut writer =
        SerializedFileWriter::new(Vec::new(), schema.unwrap().into(), properties.into()).unwrap();
    let mut group = writer.next_row_group().unwrap();
    for number in 0..6 {
        let mut column = group.next_column().unwrap().unwrap();
        let levels = [0i16, 0];
        let integers = |values: [i64; 2]| values;
        match number {
            1 => drop(column.typed::<FloatType>().write_batch(&[0.5, -1.0], None, None).unwrap()),
            2 => drop(column.typed::<BoolType>().write_batch(&[true, false], None, None).unwrap()),
            5 => drop(column.typed::<Int64Type>().write_batch(&[], Some(&levels), Some(&levels))),
            number => {
                let values = integers([[7, 7], [0; 2], [0; 2], [-1, 3], [9, 9]][number]);
                column.typed::<Int64Type>().write_batch(&values, None, None).unwrap();
            }
        }
        column.close().unwrap();
    }
    group.close().unwrap();
    let bytes = writer.into_inner().unwrap();
    let numbers = |column| read(&bytes, Form::Parquet, &[(column, Wanted::Numbers)]);
    assert_eq!(numbers(0).unwrap(), [Values::Numbers(vec![7.0, 7.0])]);
    assert_eq!(numbers(1).unwrap(), [Values::Numbers(vec![0.5, -1.0])]);
    assert_eq!(numbers(2).unwrap(), [Values::Numbers(vec![1.0, 0.0])]);
    assert_eq!(numbers(3).unwrap(), [Values::Numbers(vec![18_446_744_073_709_551_615.0, 3.0])]);
    assert!(matches!(numbers(4), Err(TableReadError::Column(name)) if name == "at"));
    assert!(matches!(numbers(5), Err(TableReadError::Column(name)) if name == "list"));
}
