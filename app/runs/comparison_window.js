// Escape and a click beside the window close it. `this` is an element of its bar.
const close = this.parentNode.querySelector('[data-c="close:0"]');
document.addEventListener('keydown', function onKey(event) {
  if (!close.isConnected) document.removeEventListener('keydown', onKey);
  else if (event.key === 'Escape') close.click();
});
const outside = this.closest('.mantine-Modal-inner');
if (outside) outside.addEventListener('click', event => { if (event.target === outside) close.click(); });
