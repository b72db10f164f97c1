//! Parquet tables.

use std::path::Path;
use std::sync::Arc;

use chaic_files::write_atomically;
use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, FloatType, Int64Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};

/// Values of a column, one per row.
#[derive(Clone, Debug, PartialEq)]
pub enum Column {
    /// Integers.
    I64(Vec<i64>),
    /// Floating-point numbers.
    F32(Vec<f32>),
    /// Lists of equal length per row, in row-major order.
    F32Rows {
        /// Length of each list.
        width: usize,
        /// Elements of all lists.
        elements: Vec<f32>,
    },
    /// Booleans.
    Bool(Vec<bool>),
    /// Strings.
    Text(Vec<String>),
    /// Non-empty lists of strings, one list per row.
    TextRows(Vec<Vec<String>>),
}

impl Column {
    fn physical_type(&self) -> Physical {
        match self {
            Column::I64(_) => Physical::INT64,
            Column::F32(_) | Column::F32Rows { .. } => Physical::FLOAT,
            Column::Bool(_) => Physical::BOOLEAN,
            Column::Text(_) | Column::TextRows(_) => Physical::BYTE_ARRAY,
        }
    }

    fn is_text(&self) -> bool {
        matches!(self, Column::Text(_) | Column::TextRows(_))
    }

    fn schema(&self, name: &str) -> Result<TypePtr> {
        let is_list = matches!(self, Column::F32Rows { .. } | Column::TextRows(_));
        let primitive = |name: &str| {
            let builder = Type::primitive_type_builder(name, self.physical_type())
                .with_repetition(Repetition::REQUIRED);
            if !self.is_text() {
                return builder.build();
            }
            let builder = builder.with_logical_type(Some(LogicalType::String));
            builder.with_converted_type(ConvertedType::UTF8).build()
        };
        if !is_list {
            return Ok(Arc::new(primitive(name)?));
        }
        let list = Type::group_type_builder("list")
            .with_repetition(Repetition::REPEATED)
            .with_fields(vec![Arc::new(primitive("element")?)])
            .build()?;
        let group = Type::group_type_builder(name)
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(Some(LogicalType::List))
            .with_converted_type(ConvertedType::LIST)
            .with_fields(vec![Arc::new(list)]);
        Ok(Arc::new(group.build()?))
    }

    fn write(&self, writer: &mut SerializedColumnWriter<'_>) -> Result<()> {
        let text = |text: &String| ByteArray::from(text.as_bytes().to_vec());
        match self {
            Column::I64(values) => writer.typed::<Int64Type>().write_batch(values, None, None)?,
            Column::F32(values) => writer.typed::<FloatType>().write_batch(values, None, None)?,
            Column::Bool(values) => writer.typed::<BoolType>().write_batch(values, None, None)?,
            Column::Text(values) => {
                let values: Vec<ByteArray> = values.iter().map(text).collect();
                writer.typed::<ByteArrayType>().write_batch(&values, None, None)?
            }
            Column::F32Rows { width, elements } => {
                let (defined, repeated) = levels(elements.chunks(*width).map(<[f32]>::len));
                let typed = writer.typed::<FloatType>();
                typed.write_batch(elements, Some(&defined), Some(&repeated))?
            }
            Column::TextRows(rows) => {
                let values: Vec<ByteArray> = rows.iter().flatten().map(text).collect();
                let (defined, repeated) = levels(rows.iter().map(Vec::len));
                let typed = writer.typed::<ByteArrayType>();
                typed.write_batch(&values, Some(&defined), Some(&repeated))?
            }
        };
        Ok(())
    }
}

/// Returns the definition and repetition levels of non-empty lists with these lengths.
fn levels(lengths: impl Iterator<Item = usize>) -> (Vec<i16>, Vec<i16>) {
    let repeated: Vec<i16> = lengths.flat_map(|n| (0..n).map(|k| i16::from(k > 0))).collect();
    (vec![1; repeated.len()], repeated)
}

/// Writes columns of equal length, with metadata entries.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, columns: &[(&str, Column)], entries: &[(&str, String)]) -> Result<()> {
    let fields: Result<Vec<TypePtr>> = columns.iter().map(|(name, c)| c.schema(name)).collect();
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields?).build()?);
    let entries: Vec<KeyValue> = entries
        .iter()
        .map(|(key, value)| KeyValue::new((*key).to_owned(), Some(value.clone())))
        .collect();
    let properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_created_by("chaic".to_owned())
        .set_key_value_metadata(Some(entries))
        .build();
    let mut bytes = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut bytes, schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (_, column) in columns {
        let mut to = group.next_column()?.expect("the schema has as many columns");
        column.write(&mut to)?;
        to.close()?;
    }
    group.close()?;
    writer.close()?;
    write_atomically(path, &bytes).map_err(|e| ParquetError::External(Box::new(e)))
}
