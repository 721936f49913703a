//! A table that is written block by block.

use std::io::{self, Write};

use ::parquet::errors::ParquetError;

use crate::block::Block;
use crate::csv;
use crate::parquet::ParquetFile;
use crate::schema::Schema;

/// The form of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    Parquet,
    Csv,
}

/// A reason why a table cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The output cannot be written.
    #[error(transparent)]
    Output(#[from] io::Error),
    /// The library for Parquet refuses the rows.
    #[error("{0}")]
    Parquet(ParquetError),
}

impl From<ParquetError> for TableError {
    /// An error of the output passes through the library, which wraps it.
    fn from(error: ParquetError) -> Self {
        match error {
            ParquetError::External(cause) => match cause.downcast::<io::Error>() {
                Ok(error) => TableError::Output(*error),
                Err(cause) => TableError::Parquet(ParquetError::External(cause)),
            },
            other => TableError::Parquet(other),
        }
    }
}

/// A table that is written to an output.
pub struct TableWriter<W: Write + Send>(Output<W>);

enum Output<W: Write + Send> {
    Parquet(Box<ParquetFile<W>>),
    Csv(W),
}

impl<W: Write + Send> TableWriter<W> {
    /// Begins a table.
    pub fn new(mut output: W, form: Form, schema: &Schema) -> Result<Self, TableError> {
        Ok(TableWriter(match form {
            Form::Parquet => Output::Parquet(Box::new(ParquetFile::new(output, schema)?)),
            Form::Csv => {
                csv::write_names(&mut output, schema)?;
                Output::Csv(output)
            }
        }))
    }

    /// Writes rows of the schema with which the table began. A block without rows changes nothing.
    pub fn write(&mut self, block: &Block) -> Result<(), TableError> {
        if block.rows() == 0 {
            return Ok(());
        }
        match &mut self.0 {
            Output::Parquet(file) => file.write(block)?,
            Output::Csv(output) => csv::write_rows(output, block)?,
        }
        Ok(())
    }

    /// Passes written rows of CSV on to their destination. Those of Parquet are readable only at the end.
    pub fn flush(&mut self) -> Result<(), TableError> {
        match &mut self.0 {
            Output::Parquet(_) => Ok(()),
            Output::Csv(output) => Ok(output.flush()?),
        }
    }

    /// Completes the table. Returns the output.
    pub fn finish(self) -> Result<W, TableError> {
        Ok(match self.0 {
            Output::Parquet(file) => file.finish()?,
            Output::Csv(output) => output,
        })
    }
}
