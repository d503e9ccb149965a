"""Tests that drive a real Chromium, and what takes pictures with one."""
