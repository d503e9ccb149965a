// Pixels of this page's width, and pixels of the screen in one pixel of its scene; nothing before there is a scene.
(() => {
  const scene = document.querySelector('canvas[data-engine]');
  return scene && scene.clientWidth ? `${innerWidth},${(scene.width / scene.clientWidth).toFixed(3)}` : '';
})()
