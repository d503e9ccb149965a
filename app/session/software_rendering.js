// The name of what draws this page, such as a graphics card's; nothing where a browser keeps it to itself.
(() => {
  try {
    const gl = document.createElement('canvas').getContext('webgl2');
    const names = gl.getExtension('WEBGL_debug_renderer_info');
    const renderer = gl.getParameter(names.UNMASKED_RENDERER_WEBGL);
    gl.getExtension('WEBGL_lose_context').loseContext();
    return renderer;
  } catch (refused) {
    return '';
  }
})()
