// From a page to the app: what scripts put into a hidden text field, as if a user had typed it.

// Puts what `read` returns into the field with viser's id, once the page has that field. The time behind it
// makes every value another one: viser does not notice an equal value. If `hasArrived` is given, the value is
// sent again until that is true: of what is set within 50 ms, viser's client may drop all but the last.
window.taSend = (id, read, hasArrived) => {
  const attempt = left => {
    if (hasArrived && hasArrived()) return;
    let element = document.querySelector(`label[for="${id}"]`), input = null;
    while (element && !(input = element.querySelector('input'))) element = element.parentElement;
    if (input) {
      // by the prototype's setter: React has replaced the element's own and would take the value for known
      const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value');
      value.set.call(input, `${read()}|${Date.now()}`);
      input.dispatchEvent(new Event('input', {bubbles: true}));
    }
    const again = !input || hasArrived;
    if (again && left) setTimeout(attempt, input ? 700 : 100, left - 1);
  };
  attempt(99);
};

// Reports a click of the main button on an element that carries data-c, or on a part of it.
window.taClick = (event, id) => {
  const target = event.target.closest('[data-c]');
  if (target && event.button === 0) taSend(id, () => target.dataset.c);
};

// Reports how far along a picture's data-span, "from,to" in units of the picture, the pressed pointer is:
// `name:k`, k in thousandths.
window.taAlong = (event, id, name) => {
  const svg = event.currentTarget, toScreen = svg.getScreenCTM();
  if (!toScreen || !(event.buttons & 1)) return;
  const x = new DOMPoint(event.clientX, event.clientY).matrixTransform(toScreen.inverse()).x;
  const [from, to] = svg.dataset.span.split(',').map(Number);
  const part = Math.round(999 * Math.min(Math.max((x - from) / (to - from), 0), 1));
  taSend(id, () => `${name}:${part}`);
};

// Reports a value of the page until the app calls taArrived.
window.taReport = (id, read) => taSend(id, read, () => (window.taKnown || {})[id]);

// Reports a value now and whenever it has become another one; nothing stands for a value that is not there yet.
window.taWatch = (id, read) => {
  let told = '';
  const look = () => {
    const value = read();
    if (!value || value === told) return;
    told = value;
    (window.taKnown = window.taKnown || {})[id] = false;
    taReport(id, read);
  };
  look();
  setInterval(look, 500);
};
window.taArrived = id => { (window.taKnown = window.taKnown || {})[id] = true; };
