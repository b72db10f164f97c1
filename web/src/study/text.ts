// Texts of a study: paragraphs, headings (#, ##) and lists (-). Other markup is shown as it is.

import { html, type TemplateResult } from "lit";

function block(lines: string[]): TemplateResult {
  const [first = ""] = lines;
  const heading = /^(#{1,2}) (.*)$/.exec(first);
  if (heading) {
    const rest = lines.length > 1 ? block(lines.slice(1)) : html``;
    return heading[1] === "#" ? html`<h2>${heading[2]}</h2>${rest}` : html`<h3>${heading[2]}</h3>${rest}`;
  }
  if (lines.every((line) => line.startsWith("- "))) {
    return html`<ul>${lines.map((line) => html`<li>${line.slice(2)}</li>`)}</ul>`;
  }
  return html`<p>${lines.join(" ")}</p>`;
}

/** Returns a text as HTML. */
export function paragraphs(text: string): TemplateResult[] {
  const blocks = text.split(/\r?\n[ \t]*\r?\n/).map((part) => part.split(/\r?\n/).map((line) => line.trim()));
  return blocks.map((lines) => lines.filter((line) => line !== "")).filter((lines) => lines.length > 0).map(block);
}
