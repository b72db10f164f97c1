// One switch: choices are offered one after the other; Enter or space takes the focused one.

/** Time for which each choice is offered, milliseconds. */
export const SCAN_MS = 1500;

/** Moves the focus through the choices that a function returns. */
export class Scanner {
  private timer = 0;

  constructor(private readonly choices: () => HTMLElement[]) {}

  /** Starts or stops offering choices. */
  set(isOn: boolean): void {
    clearInterval(this.timer);
    this.timer = isOn ? window.setInterval(() => this.next(), SCAN_MS) : 0;
  }

  private next(): void {
    const choices = this.choices();
    // The focused element may be inside of a shadow root.
    let focused = document.activeElement;
    while (focused?.shadowRoot?.activeElement) focused = focused.shadowRoot.activeElement;
    const at = choices.findIndex((choice) => choice === focused);
    choices[(at + 1) % choices.length]?.focus();
  }
}
