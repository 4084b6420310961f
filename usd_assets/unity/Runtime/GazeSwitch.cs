// SPDX-License-Identifier: Apache-2.0
using System;
using UnityEngine;

namespace StereoCell
{
    /// <summary>The time for which one target has been gazed at. Plain data.</summary>
    public struct Dwell
    {
        /// <summary>Seconds. Longest time that one frame adds, so that a stall does not count as a gaze.</summary>
        const float LongestFrame = 0.1f;

        public object Target;
        public float Elapsed;

        /// <summary>Whether the dwell has fired for this target. It does not fire again until the gaze leaves the
        /// target.</summary>
        public bool HasFired;

        /// <summary>Advance by one frame. Returns whether the dwell fires on this frame. The first frame on a target
        /// starts its clock and adds no time.</summary>
        public bool Advance(object target, float seconds, float needed)
        {
            if (!ReferenceEquals(target, Target))
            {
                Target = target;
                Elapsed = 0;
                HasFired = false;
                return false;
            }
            if (target == null || HasFired) return false;
            Elapsed += Math.Min(Math.Max(seconds, 0), LongestFrame);
            return HasFired = Elapsed >= needed;
        }

        /// <summary>0 to 1. The share of the needed time that has passed; 0 after the dwell has fired.</summary>
        public float Progress(float needed)
        {
            return Target == null || HasFired ? 0 : Math.Min(1, Elapsed / needed);
        }
    }

    /// <summary>Switches a tile between its surfaces and its volume when it has been gazed at for 1.5 s.</summary>
    [DisallowMultipleComponent, AddComponentMenu("StereoCell/Gaze Switch")]
    public sealed class GazeSwitch : MonoBehaviour
    {
        [Tooltip("Camera of the viewer. If it is empty, the main camera is used.")]
        public Camera viewer;

        [Min(0.1f), Tooltip("Time in seconds for which the gaze must rest on a tile to switch it.")]
        public float dwell = 1.5f;

        [Tooltip("Largest distance of a tile that is switched, in world units.")]
        public float reach = 100;

        Dwell state;

        /// <summary>0 to 1. Progress of the dwell, for a reticle.</summary>
        public float Progress
        {
            get { return state.Progress(dwell); }
        }

        /// <summary>The tile that is looked at; null if there is none.</summary>
        public Tile Target
        {
            get { return state.Target as Tile; }
        }

        /// <summary>Switch the tile that is looked at now, for a button. The dwell then does not fire until the
        /// gaze has left this tile.</summary>
        public void Press()
        {
            if (Target == null) return;
            state.HasFired = true;
            Target.Switch();
        }

        void Update()
        {
            var eye = viewer != null ? viewer : Camera.main;
            if (eye == null) return;
            var tile = TileAhead(eye.transform);
            if (state.Advance(tile, Time.unscaledDeltaTime, dwell)) tile.Switch();
        }

        Tile TileAhead(Transform eye)
        {
            RaycastHit hit;
            if (!Physics.Raycast(eye.position, eye.forward, out hit, reach, Physics.DefaultRaycastLayers, QueryTriggerInteraction.Collide))
            {
                return null;
            }
            var tile = hit.collider.GetComponentInParent<Tile>();
            return tile == null ? null : tile;  // an object that Unity has destroyed equals null
        }
    }
}
