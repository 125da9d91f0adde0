#!/bin/bash
set -e
export ROBOT=r1 RATE=${RATE:-10}
source /opt/ros/jazzy/setup.bash
ros2 run tf2_ros static_transform_publisher --x 0.1 --yaw 1.57 --frame-id base_link --child-frame-id laser &
PID=$!
if [ -n "$SIM" ]; then ros2 launch sim world.launch.py world:=empty & else nice -n 5 ros2 run drv node --ros-args -r __ns:=/"$ROBOT" -p rate:=$RATE & fi
trap 'kill $PID' EXIT
for cam in front rear; do python3 ./cam.py --name "$cam" > /dev/null 2>&1 & done
" " &
exec ros2 launch nav nav.launch.xml params:="$(pwd)/nav.yaml"
