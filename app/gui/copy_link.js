// Copies the page's address and says so on the button; `this` is the button.
(button => {
  const done = () => {
    button.classList.add('ta-done');
    setTimeout(() => button.classList.remove('ta-done'), 1500);
  };
  const byHand = () => {
    const field = document.createElement('textarea');
    field.value = location.href;
    document.body.appendChild(field);
    field.select();
    document.execCommand('copy');
    field.remove();
    done();
  };
  // a page without HTTPS on another machine has no clipboard
  if (navigator.clipboard) navigator.clipboard.writeText(location.href).then(done, byHand);
  else byHand();
})(this)
