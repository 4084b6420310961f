// SPDX-License-Identifier: Apache-2.0
using UnityEngine;
using UnityEngine.XR;

namespace StereoCell.Samples
{
    /// <summary>Turns and moves the camera with the head. It works with any XR plug-in and needs no package for
    /// input.</summary>
    [AddComponentMenu("StereoCell/Head Pose")]
    public sealed class HeadPose : MonoBehaviour
    {
        void OnEnable()
        {
            Application.onBeforeRender += Follow;
        }

        void OnDisable()
        {
            Application.onBeforeRender -= Follow;
        }

        void Update()
        {
            Follow();
        }

        void Follow()
        {
            var head = InputDevices.GetDeviceAtXRNode(XRNode.CenterEye);
            if (!head.isValid) return;
            Quaternion rotation;
            Vector3 position;
            if (head.TryGetFeatureValue(CommonUsages.centerEyeRotation, out rotation)) transform.localRotation = rotation;
            if (head.TryGetFeatureValue(CommonUsages.centerEyePosition, out position)) transform.localPosition = position;
        }
    }
}
