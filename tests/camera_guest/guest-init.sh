#!/bin/busybox sh
# The guest's first process: mounts the machine's files, loads the virtual camera, runs the command, switches off.
b=/bin/busybox
$b mkdir -p /proc /sys /dev /machine /changes /new
$b mount -t proc proc /proc
$b mount -t sysfs sys /sys
$b mount -t devtmpfs dev /dev
for module in $($b cat /modules/order); do
    $b insmod "/modules/$module" || $b echo "insmod $module failed" >/dev/console
done
options=trans=virtio,version=9p2000.L,msize=1048576
$b mount -t 9p -o "$options,ro,cache=loose" machine /machine || $b echo "no files of the machine" >/dev/console
$b mount -t tmpfs tmpfs /changes
$b mkdir /changes/upper /changes/work
$b mount -t overlay -o lowerdir=/machine,upperdir=/changes/upper,workdir=/changes/work overlay /new
$b mount -t proc proc /new/proc
$b mount -t sysfs sys /new/sys
$b mount -t devtmpfs dev /new/dev
$b mkdir -p /new/dev/pts /new/dev/shm
$b mount -t devpts devpts /new/dev/pts
$b mount -t tmpfs tmpfs /new/dev/shm
$b mount -t tmpfs tmpfs /new/run
$b ln -s /proc/self/fd /new/dev/fd 2>/dev/null
$b mkdir -p /new/run/out
$b mount -t 9p -o "$options,cache=none" out /new/run/out || $b echo "no folder to write to" >/dev/console
$b ip link set lo up
. /new/run/out/settings
$b mkdir -p /new/lib/modules
$b mount -o bind "/new$MODULES" /new/lib/modules
if [ -n "$VIVID" ]; then
    # shellcheck disable=SC2086  # options are words
    $b chroot /new /bin/busybox modprobe vivid $VIVID || $b echo "no virtual camera" >/dev/console
fi
$b stty -F /dev/ttyS1 raw -echo
$b chroot /new /bin/sh /run/out/command </dev/null >/dev/ttyS1 2>&1
status=$?
$b dmesg >/new/run/out/dmesg
echo "$status" >/new/run/out/status
$b reboot -f
