"""What maps do in the browser by themselves: the hover card, the nearest cell, the enlarged view.

``INSTALL`` puts it into a page once, whatever the number of maps; pictures say what they need in their
attributes. ``data-h`` is the text of a hover card. A nested map (``data-cells``, see ``viz.maps.nested``)
gets ``data-c``, the cell that a click means, while a filled one is near the pointer. Diagrams of trends
(``data-points``, see ``viz.runs.trend``) are read at the generation nearest to the pointer.
"""

from __future__ import annotations

import html
from typing import Final

from viz.maps.nested import MARK

REACH: Final = 1.6
"""How far from a cell of a nested map the pointer may be, in cells."""

_SCRIPT: Final = """
if(!window.taZoom){
var tip=document.createElement('div');
tip.id='ta-tip';
tip.style.cssText='position:fixed;display:none;z-index:9999;pointer-events:none;white-space:pre-line;'
+'font:12px/1.45 system-ui,sans-serif;padding:6px 9px;border-radius:6px;background:#161718f5;color:#e6e9ee;'
+'border:1px solid #ffffff2e;box-shadow:0 4px 14px #0008;font-variant-numeric:tabular-nums';
var look=document.createElement('style');
look.textContent='#ta-tip::first-line{font-weight:600}';
document.head.appendChild(look);
var table=function(s){
return s.taCells||(s.taHints=JSON.parse(s.dataset.hints),s.taCells=s.dataset.cells.split(';')
.filter(Boolean).map(function(t){t=t.split(',');t[0]=+t[0];t[1]=+t[1];return t}))};
var near=function(s,e){
var m=s.getScreenCTM();
if(!m)return null;
var p=new DOMPoint(e.clientX,e.clientY).matrixTransform(m.inverse()),
z=s.dataset.size.split(','),w=+z[0],h=+z[1],best=null,d=REACH*REACH;
table(s).forEach(function(c){
var a=(c[0]+w/2-p.x)/w,b=(c[1]+h/2-p.y)/h,q=a*a+b*b;
if(q<d){d=q;best=c}});
return best};
var hint=function(s,c){
var numbers=c[4].split(' '),k=0;
return s.taHints[+c[3]].replace(/MARK/g,function(){return numbers[k++]})};
var show=function(e,text){
tip.textContent=text;
(e.target.closest('dialog')||document.body).appendChild(tip);
tip.style.display='block';
var x=e.clientX+14,y=e.clientY+16;
if(x+tip.offsetWidth>innerWidth-6)x=e.clientX-14-tip.offsetWidth;
if(y+tip.offsetHeight>innerHeight-6)y=e.clientY-10-tip.offsetHeight;
tip.style.left=Math.max(x,4)+'px';tip.style.top=Math.max(y,4)+'px'};
var reading=null;
var read=function(s,e){
var m=s.getScreenCTM(),a=s.querySelector('.ta-at');
if(!m||!a)return false;
var p=new DOMPoint(e.clientX,e.clientY).matrixTransform(m.inverse()),best=null,
size=s.dataset.plot.split(','),w=+size[0],h=+size[1];
s.dataset.plots.split(';').forEach(function(t){
var c=t.split(','),x=p.x-c[0],y=p.y-c[1];
if(x<-9||x>w+9||y<-9||y>h+9)return;
(s.taPoints||(s.taPoints=JSON.parse(s.dataset.points))).forEach(function(q){
var d=Math.abs(q[0]-x);
if(!best||d<best[0])best=[d,q]})});
if(!best)return false;
reading=a;
a.setAttribute('visibility','visible');
a.setAttribute('transform','translate('+best[1][0]+' 0)');
show(e,best[1][1]);
return true};
var move=function(e){
var t=e.target.closest?e.target.closest('[data-h],.ta-nested,[data-points]'):null;
if(reading){reading.setAttribute('visibility','hidden');reading=null}
if(t&&t.dataset.points&&!read(t,e))t=null;
if(!t){tip.style.display='none';return}
if(t.dataset.points)return;
if(!t.dataset.cells){show(e,t.dataset.h);return}
var c=near(t,e),r=t.querySelector('.ta-near');
r.setAttribute('visibility',c?'visible':'hidden');
if(!c){delete t.dataset.c;tip.style.display='none';return}
t.dataset.c=t.dataset.map+':'+c[2].replace(/[.]/g,',');
r.setAttribute('x',c[0]);r.setAttribute('y',c[1]);
show(e,hint(t,c))};
document.addEventListener('pointermove',move,true);
document.addEventListener('pointerdown',move,true);
document.addEventListener('pointerout',function(e){if(!e.relatedTarget)tip.style.display='none'},true);
window.taCells=table;
window.taUnhover=function(){tip.style.display='none'};
window.taZoom=function(b){
var s=b.closest('.ta-picture').querySelector('svg').cloneNode(true),v=s.viewBox.baseVal,
d=document.createElement('dialog'),x=document.createElement('button');
delete s.dataset.c;d.className='ta-dialog';
d.style.cssText='border:1px solid #ffffff2e;border-radius:10px;padding:14px 18px;background:#222324;'
+'color:#e6e9ee;max-width:none;max-height:none;overflow:hidden';
s.insertAdjacentHTML('beforeend','<style>.ta-dialog text{font-size:7px}</style>');
s.style.width='min(92vw,calc('+v.width/v.height+'*(100vh - 70px)))';
x.textContent='\\u00d7';x.setAttribute('aria-label','Close');x.autofocus=true;
x.style.cssText='position:absolute;top:4px;right:6px;border:0;background:none;color:inherit;'
+'font-size:20px;line-height:1;cursor:pointer;outline-offset:-2px';
x.onclick=function(){d.close()};
d.onclick=function(e){if(e.target===d)d.close()};
d.onclose=function(){document.body.appendChild(tip);tip.style.display='none';d.remove()};
s.addEventListener('pointerdown',function(){if(s.dataset.c)setTimeout(function(){d.close()},120)});
d.append(s,x);document.body.appendChild(d);d.showModal()}}
"""

_CODE = "".join(_SCRIPT.split("\n")).replace("REACH", str(REACH)).replace("MARK", MARK)


def install(code: str) -> str:
    """Return HTML that runs JavaScript: added scripts do not run, but the error of an added image does."""
    return f'<img alt="" src="data:," style="display:none" onerror="{html.escape(code)}">'


INSTALL: Final = install(_CODE)
"""HTML that brings it into a page."""

ENLARGE: Final = (
    '<button type="button" onclick="taZoom(this)" title="Enlarge" aria-label="Enlarge" style="border:0;'
    "background:none;color:inherit;opacity:.75;cursor:pointer;padding:0 2px;font-size:14px;line-height:1"
    '">⤢</button>'
)
"""A button inside an element of class ``ta-picture`` that shows its picture as large as the window."""
