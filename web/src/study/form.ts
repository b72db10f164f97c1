// Element <chaic-form>: a questionnaire of a study.

import { html, LitElement, nothing, type TemplateResult } from "lit";
import { property, state } from "lit/decorators.js";
import type { Form, Item, Ratings } from "./content.js";

/** Largest number of ratings in a row of a narrow page. */
const NARROW_COLUMNS = 7;

/** Questionnaire. Dispatches `answered` with the ratings. It uses the styles of the page. */
export class ChaicForm extends LitElement {
  @property({ attribute: false }) form?: Form;
  /** Role of the other agent of the team. */
  @property() other = "helper";

  @state() private ratings: Ratings = {};
  /** True after a try to go on without all answers. */
  @state() private isWarned = false;

  protected override createRenderRoot(): HTMLElement {
    return this;
  }

  private missing(): Item[] {
    return (this.form?.items ?? []).filter((item) => this.ratings[item.id] === undefined);
  }

  /** Returns the inputs that a person answers next: those of the first item without an answer. */
  nextInputs(): HTMLElement[] {
    const [item] = this.missing();
    if (!item) return [...this.querySelectorAll<HTMLElement>("button")];
    return [...this.querySelectorAll<HTMLElement>(`fieldset[data-item="${item.id}"] input`)];
  }

  private submit(event: Event): void {
    event.preventDefault();
    const missing = this.missing();
    if (missing.length > 0 && !this.isWarned) {
      this.isWarned = true;
      this.querySelector<HTMLElement>(`fieldset[data-item="${missing[0]!.id}"] input`)?.focus();
      return;
    }
    const entries = this.form!.items.map((item) => [item.id, this.ratings[item.id] ?? null]);
    this.dispatchEvent(new CustomEvent<Ratings>("answered", { detail: Object.fromEntries(entries) }));
  }

  override render(): TemplateResult {
    const { form } = this;
    if (!form) return html``;
    const n = this.missing().length;
    const words = (text: string): string => text.replaceAll("{other}", this.other);
    return html`<form class="questions" @submit=${(event: Event) => this.submit(event)}>
      <p>${words(form.instruction)}</p>
      ${form.items.map((item) => this.item(form, item, words(item.text)))}
      ${this.isWarned && n > 0
        ? html`<p role="alert">${n === 1 ? "One question has" : `${n} questions have`} no answer. You may leave them out: select Continue again.</p>`
        : nothing}
      <p><button>Continue</button></p>
    </form>`;
  }

  private item(form: Form, item: Item, text: string): TemplateResult {
    const n = Math.floor((form.last - form.first) / form.step) + 1;
    const ratings = Array.from({ length: n }, (_, k) => form.first + k * form.step);
    const choose = (rating: number): void => {
      this.ratings = { ...this.ratings, [item.id]: rating };
    };
    const name = (rating: number): string => {
      if (rating === form.first) return `${rating}, ${item.low}`;
      return rating === form.last ? `${rating}, ${item.high}` : String(rating);
    };
    return html`<fieldset data-item=${item.id}>
      <legend>${text}</legend>
      <p class="small" aria-hidden="true">${form.first}: ${item.low}, ${form.last}: ${item.high}</p>
      <div class="ratings" style="--n: ${n}; --narrow: ${Math.min(n, NARROW_COLUMNS)}">
        ${ratings.map(
          (rating) => html`<label class="rating">
            <input
              type="radio"
              name=${item.id}
              value=${rating}
              aria-label=${name(rating)}
              .checked=${this.ratings[item.id] === rating}
              @change=${() => choose(rating)}
            /><span aria-hidden="true">${rating}</span>
          </label>`,
        )}
      </div>
    </fieldset>`;
  }
}

customElements.define("chaic-form", ChaicForm);
