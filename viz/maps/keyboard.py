"""The keyboard on maps, in the browser: arrows choose a robot, Enter replays it, Space plays and pauses.

A map that has the focus takes the arrow keys; elsewhere they turn the camera. They go to the next filled
cell in their direction, straight ahead rather than aside, so empty cells hold nobody up. The cell shows its
hover card at once and is clicked, as by a mouse, when the keys have rested for a moment: nothing is
simulated for robots that are only passed by. Space works wherever no field or button has the focus.

A map that is redrawn is another element: the focus and the marked cell are given back to it. ``render_key``
makes an element that a key clicks. Needs ``viz.maps.interaction`` in the page.
"""

from __future__ import annotations

from typing import Final

from viz.maps.heatmap import CELL_HEIGHT, CELL_WIDTH
from viz.maps.interaction import install

REST: Final = 220
"""Milliseconds without another arrow key after which the marked robot is chosen."""
ASIDE: Final = 3.0
"""How many cells straight ahead one cell aside is worth."""

_SCRIPT: Final = """
if(!window.taKeyboard){
window.taKeyboard=true;
var held=null,at=null,timer=0,ours=false;
var ways={ArrowLeft:[-1,0],ArrowRight:[1,0],ArrowUp:[0,-1],ArrowDown:[0,1]};
var mapOf=function(e){return e&&e.closest?e.closest('svg.ta-map'):null};
var find=function(name){
return Array.from(document.querySelectorAll('svg.ta-map')).find(function(s){
return s.dataset.map===name&&!s.closest('dialog')})};
var cells=function(s){
if(s.dataset.cells!==undefined){
var z=s.dataset.size.split(',');
return taCells(s).map(function(t){
return{name:t[2].replace(/[.]/g,','),x:t[0],y:t[1],w:+z[0],h:+z[1],element:s}})}
return Array.from(s.querySelectorAll('[data-filled="1"]')).map(function(g){
var r=g.firstElementChild;
return{name:g.dataset.c.split(':')[1],x:+r.getAttribute('x'),y:+r.getAttribute('y'),w:WIDTH,h:HEIGHT,
element:g}})};
var named=function(s,name){return cells(s).find(function(c){return c.name===name})};
var chosen=function(s){
var r=s.querySelector('.ta-outer~.ta-ring'),m=r&&getComputedStyle(r);
if(!m||m.visibility!=='visible')return null;
m=new DOMMatrix(m.transform);
var c=cells(s).find(function(c){return Math.abs(c.x-m.e)<.5&&Math.abs(c.y-m.f)<.5});
return c&&c.name};
var next=function(s,from,way){
var best=null,least=1e9;
cells(s).forEach(function(c){
var x=(c.x-from.x)/from.w,y=(c.y-from.y)/from.h,ahead=x*way[0]+y*way[1],
aside=Math.abs(x*way[1])+Math.abs(y*way[0]),cost=ahead+ASIDE*aside;
if(ahead>.2&&cost<least){least=cost;best=c}});
return best};
var point=function(s,c,type){
var q=new DOMPoint(c.x+.45*c.w,c.y+.45*c.h).matrixTransform(s.getScreenCTM());
ours=true;
c.element.dispatchEvent(new PointerEvent(type,{bubbles:true,button:0,clientX:q.x,clientY:q.y}));
ours=false};
var mark=function(s,c){
var r=s.querySelector('.ta-near');
r.setAttribute('x',c.x);r.setAttribute('y',c.y);r.setAttribute('visibility','visible')};
var click=function(){
clearTimeout(timer);
var s=held&&find(held),c=s&&at&&named(s,at);
if(c)point(s,c,'pointerdown')};
var unmark=function(s){
var r=s&&s.querySelector('.ta-near');
if(r)r.setAttribute('visibility','hidden')};
var leave=function(){
if(held)unmark(find(held));
held=at=null;clearTimeout(timer)};
document.addEventListener('focusin',function(e){
var s=mapOf(e.target),name=s?s.dataset.map:null;
if(name!==held){leave();held=name}},true);
document.addEventListener('pointerdown',function(e){
if(ours)return;
var s=mapOf(e.target);
if(!s)leave();
else{
clearTimeout(timer);
unmark(s);
at=s.dataset.map===held&&e.target.closest('[data-filled="1"]')
?e.target.closest('[data-c]').dataset.c.split(':')[1]:null}},true);
window.addEventListener('keydown',function(e){
if(e.ctrlKey||e.metaKey||e.altKey||e.isComposing)return;
var a=document.activeElement,s=mapOf(a),way=ways[e.key];
if(e.key===' '&&(s||!a||a===document.body||a.querySelector('canvas')||a.tagName==='CANVAS')){
var k=document.querySelector('.ta-key[data-key=space]');
if(k&&!e.repeat){
ours=true;
k.dispatchEvent(new PointerEvent('pointerdown',{bubbles:true,button:0}));
ours=false}
}else if(!s)return;
else if(e.key==='Escape'){leave();taUnhover();a.blur()}
else if(e.key==='Enter'){at=at||chosen(s)||s.dataset.start;if(!e.repeat)click()}
else if(way){
var here=named(s,at||chosen(s)||s.dataset.start),there=here&&at===null&&!chosen(s)&&!s.dataset.ring
?here:here&&next(s,here,way);
if(there){
at=there.name;
there.element.scrollIntoView({block:'nearest'});
point(s,there,'pointermove');
mark(s,there);
clearTimeout(timer);
timer=setTimeout(click,REST)}
}else return;
e.preventDefault();e.stopPropagation()},true);
new MutationObserver(function(){
var s=held&&document.activeElement===document.body?find(held):null;
if(!s)return;
s.focus({preventScroll:true});
var c=at&&named(s,at);
if(c)mark(s,c)}).observe(document.body,{childList:true,subtree:true})}
"""

_CODE = (
    "".join(_SCRIPT.split("\n"))
    .replace("WIDTH", str(CELL_WIDTH))
    .replace("HEIGHT", str(CELL_HEIGHT))
    .replace("ASIDE", str(ASIDE))
    .replace("REST", str(REST))
)

INSTALL: Final = install(_CODE)
"""HTML that brings it into a page."""


def render_key(key: str, name: str, on_pointer_down: str) -> str:
    """Return an unseen element that a key clicks.

    Args:
        key: ``space``.
        name: that is reported with cell 0.
        on_pointer_down: as of the maps.
    """
    return (
        f'<i class="ta-key" hidden data-key="{key}" data-c="{name}:0" onpointerdown="{on_pointer_down}"></i>'
    )
