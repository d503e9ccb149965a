"""The page with the picture answers this computer alone."""

import http.client
import json

import pytest

from app.drive.page import PicturePage
from engine.errors import InvalidData


def ask(page, path, host=None):
    port = int(page.address.rsplit(":", 1)[1])
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    connection.request("GET", path, headers={"Host": host} if host else {})
    answer = connection.getresponse()
    return answer.status, answer.getheader("Content-Type"), answer.read()


@pytest.fixture
def page():
    made = PicturePage(0)
    yield made
    made.close()


def test_it_shows_the_last_picture_and_what_the_board_does(page):
    page.show(b"first", "settling")
    page.show(b"jpeg", "steering, 12.3 cm to go")
    assert ask(page, "/picture.jpg?3") == (200, "image/jpeg", b"jpeg")
    status, _, content = ask(page, "/state")
    assert (status, json.loads(content)) == (200, {"text": "steering, 12.3 cm to go"})
    status, kind, content = ask(page, "/")
    assert (status, kind, b"picture.jpg" in content) == (200, "text/html; charset=utf-8", True)
    assert ask(page, "/etc/passwd")[0] == 404


def test_a_page_of_another_name_is_refused(page):
    page.show(b"jpeg", "steering")
    assert ask(page, "/picture.jpg", host="evil.example:80")[0] == 403
    assert ask(page, "/picture.jpg", host="localhost:1234")[0] == 200


def test_a_port_in_use_gets_one_line(page):
    port = int(page.address.rsplit(":", 1)[1])
    with pytest.raises(InvalidData, match=f"cannot listen on port {port} .*; choose another with --page"):
        PicturePage(port)
