// Saves the scene as a PNG under the name of the page.
(() => {
  const attempt = left => setTimeout(() => requestAnimationFrame(() => {
    const scene = document.querySelector('canvas[data-engine]');
    const picture = document.createElement('canvas');
    [picture.width, picture.height] = [scene.width, scene.height];
    const pen = picture.getContext('2d');
    // what was drawn in this frame is there until the frame ends
    pen.drawImage(scene, 0, 0);
    const middle = pen.getImageData(picture.width >> 2, picture.height >> 1, picture.width >> 1, 40).data;
    if (!middle.some(value => value) && left) return attempt(left - 1);
    pen.globalCompositeOperation = 'destination-over';
    pen.fillStyle = getComputedStyle(document.body).backgroundColor;
    pen.fillRect(0, 0, picture.width, picture.height);
    const link = document.createElement('a');
    link.download = `${document.title.replace(/[^A-Za-z0-9]+/g, '-')}.png`;
    link.href = picture.toDataURL('image/png');
    link.click();
  }), 0);
  attempt(60);
})()
