// Input with one switch (scanning): choices are focused one after the other; Enter or space takes the focused choice.

import { html, nothing, type ReactiveControllerHost, type TemplateResult } from "lit";

/** Times for which each choice is offered, seconds. */
const SECONDS = [1, 1.5, 2.5, 4];
const DEFAULT_SECONDS = 1.5;

/** Moves the focus through the choices that a function returns. */
export class Scanner {
  private timer = 0;
  private isOn = false;
  private seconds = DEFAULT_SECONDS;

  /** `host` draws the controls, `choices` returns what is offered. */
  constructor(
    private readonly host: ReactiveControllerHost,
    private readonly choices: () => HTMLElement[],
  ) {}

  /** Stops offering choices. */
  stop(): void {
    this.set(false);
  }

  /** Renders the switch, and the time for each choice while it is on. */
  controls(label: string): TemplateResult {
    const toggle = (event: Event): void => this.set((event.target as HTMLInputElement).checked);
    const change = (event: Event): void => {
      this.seconds = Number((event.target as HTMLSelectElement).value);
      this.set(this.isOn);
      // A person with one switch cannot move the focus away.
      (event.target as HTMLSelectElement).blur();
    };
    return html`<label>
        <input type="checkbox" class="scan" .checked=${this.isOn} @change=${toggle} />
        ${label}
      </label>
      ${this.isOn
        ? html`<label>
            Time for each choice
            <select @change=${change}>
              ${SECONDS.map((s) => html`<option value=${s} ?selected=${s === this.seconds}>${s} s</option>`)}
            </select>
          </label>`
        : nothing}`;
  }

  private set(isOn: boolean): void {
    clearInterval(this.timer);
    this.isOn = isOn;
    this.timer = isOn ? window.setInterval(() => this.next(), 1000 * this.seconds) : 0;
    this.host.requestUpdate();
  }

  private next(): void {
    // The focused element may be inside of a shadow root.
    let focused = document.activeElement;
    while (focused?.shadowRoot?.activeElement) focused = focused.shadowRoot.activeElement;
    // Scanning pauses while a person changes the time.
    if (focused?.matches("select")) return;
    const choices = this.choices();
    const at = choices.findIndex((choice) => choice === focused);
    choices[(at + 1) % choices.length]?.focus();
  }
}
