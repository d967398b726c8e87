"""What runs inside the sandbox: the zygote, the warden of one notebook, and the processes that hold its state.

This folder and `autograder.wire` are all of the grader that a sandbox contains. Inside, they are mounted under another
package name, so nothing here imports the grader by name.
"""
