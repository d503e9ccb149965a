// From a page to the app: what scripts put into a hidden text field, as if a user had typed it.

// Sends one message after another, with time between: of what is set within 50 ms, in whatever fields, viser's
// client may drop all but the last. What `replaces` takes the place of what waits for the same field and
// replaces too.
window.taWaiting = window.taWaiting || [];
window.taQueue = (id, send, replaces) => {
  const at = replaces ? taWaiting.findIndex(one => one.replaces && one.id === id) : -1;
  if (at < 0) taWaiting.push({id, send, replaces});
  else taWaiting[at].send = send;
  if (window.taPausing) return;
  const next = () => {
    window.taPausing = false;
    while (taWaiting.length && !window.taPausing) window.taPausing = taWaiting.shift().send();
    // a timer that is set after viser's runs after it, however late both are
    if (window.taPausing) setTimeout(next, 60);
  };
  next();
};

// Puts what `read` returns into the field with viser's id, once the page has that field. The time behind it
// makes every value another one: viser does not notice an equal value. If `hasArrived` is given, the value is
// sent again until that is true. Of those that replace, only the last one is sent.
window.taSend = (id, read, hasArrived, replaces) => {
  const attempt = left => {
    if (hasArrived && hasArrived()) return false;
    let element = document.querySelector(`label[for="${id}"]`), input = null;
    while (element && !(input = element.querySelector('input'))) element = element.parentElement;
    const later = () => taQueue(id, () => attempt(left - 1), replaces);
    if ((!input || hasArrived) && left) setTimeout(later, input ? 700 : 100);
    if (!input) return false;
    // by the prototype's setter: React has replaced the element's own and would take the value for known
    const value = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, 'value');
    value.set.call(input, `${read()}|${Date.now()}`);
    input.dispatchEvent(new Event('input', {bubbles: true}));
    return true;
  };
  taQueue(id, () => attempt(99), replaces);
};

// Reports a click of the main button on an element that carries data-c, or on a part of it.
window.taClick = (event, id) => {
  const target = event.target.closest('[data-c]');
  if (!target || event.button !== 0) return;
  const cell = target.dataset.c;
  taSend(id, () => cell);
};

// Reports how far along a picture's data-span, "from,to" in units of the picture, the pressed pointer is:
// `name:k`, k in thousandths.
window.taAlong = (event, id, name) => {
  const svg = event.currentTarget, toScreen = svg.getScreenCTM();
  if (!toScreen || !(event.buttons & 1)) return;
  const x = new DOMPoint(event.clientX, event.clientY).matrixTransform(toScreen.inverse()).x;
  const [from, to] = svg.dataset.span.split(',').map(Number);
  const part = Math.round(999 * Math.min(Math.max((x - from) / (to - from), 0), 1));
  taSend(id, () => `${name}:${part}`, null, true);
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
