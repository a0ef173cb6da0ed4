"""A user's own robot as a URDF, an SDF and a MuJoCo model."""

URDF = """<?xml version="1.0"?>
<!-- mine, keep this: a > b -->
<robot name="mine">
  <link name="base_footprint"/>
  <link name="base_link"/>
  <joint name="foot" type="fixed">
    <parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.03"/></joint>
  <link name="wheel_l"><collision><geometry><cylinder radius='0.03' length="0.01"/></geometry></collision>
    <visual><geometry><mesh filename="package://mine/wheel.dae"/></geometry></visual></link>
  <link name="wheel_r"><collision><geometry><cylinder radius="0.03" length="0.01"/></geometry></collision></link>
  <joint name="left_wheel_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_l"/>
    <origin xyz="0.02 0.08 0" rpy="-1.5708 0 0"/><axis xyz="0 0 1"/>
  </joint>
  <joint name="right_wheel_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_r"/>
    <origin xyz="0.02 -0.08 0" rpy="-1.5708 0 0"/><axis xyz="0 0 1"/>
  </joint>
  <link name="camera_link"/>
  <joint name="eye" type="fixed">
    <parent link="base_link"/><child link="camera_link"/><origin xyz="0.08 0 0.05"/></joint>
  <gazebo><plugin filename="gz-sim-diff-drive-system" name="gz::sim::systems::DiffDrive">
    <wheel_separation>0.16</wheel_separation></plugin></gazebo>
</robot>
"""
SDF = """<sdf version="1.9"><world name="w"><model name="mine">
  <link name="chassis"><pose relative_to="__model__">0 0 0.05 0 0 0</pose>
    <sensor name="eye" type="camera"><pose>0.06 0 0.04 0 0.3 0</pose>
      <camera><horizontal_fov>1.2</horizontal_fov><image><width>640</width><height>480</height></image></camera></sensor>
  </link>
  <link name="lw"><pose relative_to="chassis">0.02 0.08 -0.02 -1.5708 0 0</pose>
    <collision name="c"><geometry><cylinder><radius>0.03</radius></cylinder></geometry></collision></link>
  <link name="rw"><pose relative_to="chassis">0.02 -0.08 -0.02 -1.5708 0 0</pose>
    <collision name="c"><geometry><cylinder><radius>0.03</radius></cylinder></geometry></collision></link>
  <joint name="a" type="revolute"><parent>chassis</parent><child>lw</child></joint>
  <joint name="b" type="revolute"><parent>chassis</parent><child>rw</child></joint>
  <plugin filename="x" name="drive"><left_joint>a</left_joint><right_joint>b</right_joint></plugin>
</model></world></sdf>
"""
MJCF = """<mujoco model="mine">
  <option timestep="0.0005"/>  <!-- mine -->
  <worldbody>
    <geom name="floor" type="plane" size="9 9 0.1"/>
    <body name="cart" pos="0 0 0"><freejoint/>
      <geom type="box" pos="-0.02 0 0.07" size="0.08 0.05 0.03" mass="0.9"/>
      <geom type="sphere" pos="-0.07 0 0.01" size="0.01" mass="0.01" condim="1" priority="1"/>
      <camera name="eye" pos="0.06 0 0.1" euler="90 0 0" fovy="75"/>
      <body name="a" pos="0 0.08 0.0318"><joint name="WheelLeft" axis="0 1 0"/>
        <geom size="0.0318" mass="0.05"/></body>
      <body name="b" pos="0 -0.08 0.0318"><joint name="WheelRight" axis="0 1 0"/>
        <geom size="0.0318" mass="0.05"/></body>
    </body>
  </worldbody>
  <contact><exclude body1="cart" body2="a"/><exclude body1="cart" body2="b"/></contact>
  <actuator><velocity joint="WheelLeft" kv="0.05"/><velocity joint="WheelRight" kv="0.05"/></actuator>
</mujoco>
"""
FILES = {"mine.urdf": URDF, "mine.sdf": SDF, "mine.xml": MJCF}
