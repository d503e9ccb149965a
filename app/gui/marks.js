// Names for what viser draws without one, so that styles find it: an element is marked by what it contains.
//
// CSS could ask for that itself, by :has(). But then a browser works out the styles of the whole page again
// after every change of any part of it, and a figure that measures its own text causes hundreds of changes.
//
// - data-ta-box="UUID" on what is around an input with a label, data-ta-label on what is around its label.
// - data-ta-around="UUID" on what is around a button.
// - data-ta-in="NAME NAME-1 NAME-2 ..." on all that is around an element with data-ta-mark="NAME" or one of
//   FOREIGN; NAME-1 is its parent alone, NAME-2 the parent of that.
(() => {
  if (window.taMarked) return;
  window.taMarked = true;

  // elements of viser's: what they are called, how they are found, and what they are the inside of
  const FOREIGN = [
    ['floating', '.mantine-Paper-root [data-ta-mark="window"]'],
    ['sheet', '[data-ta-mark="robot"]', 'div[style*="grid-template-rows"]'],
    ['what-if', '[role="tablist"] > [title="What if"]'],
    ['settings', '.tabler-icon-adjustments'],
    ['closable', '[id^="upload-"] .mantine-Notification-closeButton'],
  ];
  const MARKING = ['[data-ta-mark]', ...FOREIGN.map(([, selector]) => selector)].join();
  const UUID = /^[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}$/;

  const around = (element, steps) => {
    for (; element && steps; steps--) element = element.parentElement;
    return element;
  };
  const nameWidget = element => {
    const id = element.id;
    if (UUID.test(id) && element.parentElement?.tagName === 'DIV') element.parentElement.dataset.taAround = id;
    if (element.matches('div > div > div > * > label[for]')) {
      around(element, 4).dataset.taBox = element.htmlFor;
      around(element, 2).dataset.taLabel = '';
    }
  };
  const nameWidgets = root => {
    nameWidget(root);
    root.querySelectorAll('[id], label[for]').forEach(nameWidget);
  };
  const nameSurroundings = () => {
    const names = new Map();
    const name = (text, inside) => {
      for (let element = around(inside, 1), k = 1; element; element = element.parentElement, k++) {
        if (!names.has(element)) names.set(element, new Set());
        names.get(element).add(text).add(`${text}-${k}`);
      }
    };
    for (const element of document.querySelectorAll('[data-ta-mark]')) name(element.dataset.taMark, element);
    for (const [text, selector, outside] of FOREIGN)
      for (const element of document.querySelectorAll(selector)) {
        const inside = outside ? element.closest(outside) : element;
        if (inside) name(text, inside);
      }
    for (const element of document.querySelectorAll('[data-ta-in]'))
      if (!names.has(element)) element.removeAttribute('data-ta-in');
    for (const [element, found] of names) {
      const value = [...found].join(' ');
      if (element.dataset.taIn !== value) element.dataset.taIn = value;
    }
  };
  const isMarking = node => node.matches(MARKING) || node.querySelector(MARKING);

  // called before what has changed is drawn
  new MutationObserver(records => {
    let marking = false;
    for (const {type, target, addedNodes, removedNodes} of records) {
      if (type === 'attributes') nameWidget(target);
      for (const node of [...addedNodes, ...removedNodes])
        marking ||= node.nodeType === Node.ELEMENT_NODE && isMarking(node);
      for (const node of addedNodes)
        if (node.nodeType === Node.ELEMENT_NODE && node.isConnected) nameWidgets(node);
    }
    if (marking) nameSurroundings();
  }).observe(document.documentElement, {
    childList: true, subtree: true, attributes: true, attributeFilter: ['id', 'for'],
  });
  nameWidgets(document.documentElement);
  nameSurroundings();
})();
