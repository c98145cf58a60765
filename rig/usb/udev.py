"""The udev rule for known boards: ``python -m rig.usb.udev`` prints it."""

from rig.ready import find_resource

if __name__ == "__main__":
    print(find_resource("packaging/60-chainrig.rules").read_text("ascii"), end="")
