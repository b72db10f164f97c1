// Redraws an element when its width changes.

import type { ReactiveController, ReactiveControllerHost } from "lit";

/** Calls a function when the width of an element changes; its height depends on what it shows. */
export class WidthObserver implements ReactiveController {
  private width = 0;
  private readonly observer = new ResizeObserver(() => {
    if (this.host.clientWidth === this.width) return;
    this.width = this.host.clientWidth;
    this.onChange();
  });

  constructor(
    private readonly host: ReactiveControllerHost & HTMLElement,
    private readonly onChange: () => void,
  ) {
    host.addController(this);
  }

  hostConnected(): void {
    this.observer.observe(this.host);
  }

  hostDisconnected(): void {
    this.observer.disconnect();
  }
}
