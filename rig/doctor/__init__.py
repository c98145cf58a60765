"""What is wrong with this computer, a board or a session, and what to do about it.

Gathering facts is apart from judging them: each check is a function of facts alone.
"""
