//! Text tables for terminals and Markdown.

use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

/// Rows of text below a header. The first column is left-aligned, the others right-aligned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextTable {
    /// Title above the table.
    pub title: String,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Cells by row.
    pub rows: Vec<Vec<String>>,
}

impl TextTable {
    /// Formats the table for a terminal.
    pub fn to_terminal(&self) -> String {
        let mut table = self.table();
        table.load_style(presets::UTF8_FULL_CONDENSED);
        format!("{}\n{}\n", self.title, table.trim_fmt())
    }

    /// Formats the table as Markdown.
    pub fn to_markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule: Vec<String> =
            (0..self.header.len()).map(|k| if k == 0 { ":--" } else { "--:" }.to_owned()).collect();
        // An empty first line of a header cell continues the title of the previous column.
        let flat = |h: &String| h.trim_start_matches('\n').replace('\n', "<br>");
        let header: Vec<String> = self.header.iter().map(flat).collect();
        let rows: String =
            self.rows.iter().map(|r| line(&r.iter().map(flat).collect::<Vec<_>>())).collect();
        format!("**{}**\n\n{}{}{rows}", self.title, line(&header), line(&rule))
    }

    fn table(&self) -> Table {
        let mut table = Table::new();
        table.set_content_arrangement(ContentArrangement::Disabled);
        table.set_header(&self.header);
        for row in &self.rows {
            table.add_row(row);
        }
        for k in 1..self.header.len() {
            if let Some(column) = table.column_mut(k) {
                column.set_cell_alignment(CellAlignment::Right);
            }
        }
        table
    }
}
