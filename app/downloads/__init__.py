"""Files for download, of one robot or of many: folders, recordings, tables. Commands make the same files.

Read in this order:

- ``downloads``: what the buttons make, and the basket of one browser.
- ``basket``: the robots put aside, and their exports.
- ``basket_panel``: the window "Take along".
- ``buildable``: whether a robot can be built from a material.
- ``robot_folder``: every file of a robot's folder.
- ``kit_folder``: those of a kit for its first module.
- ``recording``: a replay as a page, a picture or a video.
"""
