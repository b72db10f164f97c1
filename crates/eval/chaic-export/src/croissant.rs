//! Metadata of data sets in the Croissant format 1.0, with the fields of its extension for
//! responsible AI 1.0 (<https://docs.mlcommons.org/croissant/>).

use serde_json::{Value, json};

use crate::card::{Creator, DataType, DatasetDescription, Field, ValueLocation, common};

/// Reference that a user of the data cites.
const CITATION: &str = "Du, W., Lyu, Q., Shan, J., Qi, Z., Zhang, H., Chen, S., Peng, A., Shu, T., Lee, K., Dariush, B., \
    Gan, C.: Constrained Human-AI Cooperation: An Inclusive Embodied Social Intelligence Challenge. \
    NeurIPS Datasets and Benchmarks (2024)";

/// Returns the metadata as JSON-LD. `id` is a short name of letters, digits and hyphens.
///
/// Names of files are relative to the folder that holds the metadata.
pub fn metadata(id: &str, description: &DatasetDescription) -> Value {
    // File sets outside any file object lie in the folder of the metadata.
    let distribution: Vec<Value> = description
        .files
        .iter()
        .map(|group| {
            json!({
                "@type": "cr:FileSet",
                "@id": group.name,
                "name": group.name,
                "description": group.description,
                "encodingFormat": group.media_type,
                "includes": group.pattern,
            })
        })
        .collect();
    let records = &description.records;
    let fields: Vec<Value> = records
        .fields
        .iter()
        .map(|field| field_metadata(records.name, records.files, field))
        .collect();
    let license = description.license.map_or_else(
        || common::NO_LICENSE.to_owned(),
        |license| format!("https://spdx.org/licenses/{license}.html"),
    );
    let mut metadata = json!({
        "@context": context(),
        "@type": "sc:Dataset",
        "conformsTo": [
            "http://mlcommons.org/croissant/1.0",
            "http://mlcommons.org/croissant/RAI/1.0",
        ],
        "name": id,
        "description": description.summary,
        "license": license,
        "version": env!("CARGO_PKG_VERSION"),
        "citeAs": CITATION,
        "keywords": description.tags,
        "rai:dataCollection": description.collection,
        "rai:dataCollectionType": ["Software Collection"],
        "rai:dataUseCases": description.uses,
        "rai:dataLimitations": description.limitations,
        "rai:dataBiases": description.biases,
        "rai:dataSocialImpact": common::SOCIAL_IMPACT,
        "rai:personalSensitiveInformation": description.personal_information,
        "distribution": distribution,
        "recordSet": [{
            "@type": "cr:RecordSet",
            "@id": records.name,
            "name": records.name,
            "description": records.description,
            "field": fields,
        }],
    });
    // Absent without a statement.
    match &description.creators[..] {
        [] => {}
        [creator] => metadata["creator"] = creator_metadata(creator),
        creators => metadata["creator"] = creators.iter().map(creator_metadata).collect(),
    }
    metadata
}

fn creator_metadata(creator: &Creator) -> Value {
    let kind = match creator {
        Creator::Person(_) => "sc:Person",
        Creator::Organization(_) => "sc:Organization",
    };
    json!({"@type": kind, "name": creator.name()})
}

fn field_metadata(records: &str, files: &str, field: &Field) -> Value {
    let data_type = match field.data_type {
        DataType::Text => "sc:Text",
        DataType::Integer => "sc:Integer",
        DataType::Float => "sc:Float",
        DataType::Boolean => "sc:Boolean",
    };
    let extract = match field.place {
        ValueLocation::Column(column) => json!({"column": column}),
        ValueLocation::JsonPath(path) => json!({"jsonPath": path}),
    };
    let mut value = json!({
        "@type": "cr:Field",
        "@id": format!("{records}/{}", field.name),
        "name": field.name,
        "description": field.description,
        "dataType": data_type,
        "source": {"fileSet": {"@id": files}, "extract": extract},
    });
    if field.is_list {
        value["repeated"] = json!(true);
    }
    value
}

/// Returns the context of Croissant 1.0, which its reader compares with its own.
fn context() -> Value {
    let in_croissant = [
        "citeAs",
        "column",
        "extract",
        "field",
        "fileProperty",
        "fileObject",
        "fileSet",
        "format",
        "includes",
        "isLiveDataset",
        "jsonPath",
        "key",
        "md5",
        "parentField",
        "path",
        "recordSet",
        "references",
        "regex",
        "repeated",
        "replace",
        "samplingRate",
        "separator",
        "source",
        "subField",
        "transform",
        "equivalentProperty",
    ];
    let mut context = json!({
        "@language": "en",
        "@vocab": "https://schema.org/",
        "cr": "http://mlcommons.org/croissant/",
        "rai": "http://mlcommons.org/croissant/RAI/",
        "dct": "http://purl.org/dc/terms/",
        "sc": "https://schema.org/",
        "conformsTo": "dct:conformsTo",
        "data": {"@id": "cr:data", "@type": "@json"},
        "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
        "examples": {"@id": "cr:examples", "@type": "@json"},
    });
    for term in in_croissant {
        context[term] = json!(format!("cr:{term}"));
    }
    context
}
