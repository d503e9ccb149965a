"""Files for download, of one robot or of many: folders, recordings, tables. Commands make the same files.

Read in this order:

- ``downloads``: what the buttons make, and the basket of one browser.
- ``basket``: the robots put aside, their exports, and the copy in the browser's tab.
- ``basket_panel``: the folder "Take along" of the right panel.
- ``robot_folder``: every file of a robot's folder.
- ``recording``: a replay as a page, a picture or a video.
"""
